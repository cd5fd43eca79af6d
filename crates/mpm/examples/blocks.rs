use constitutive::{FlowCurve, LawSettings, Liquid};
use mpm::settings::{ShearOperator, Tangent};
use mpm::{LiquidMaterial, LiquidSettings, LiquidStepper, NoSolid, Particle, Particles, Vector, fill};
use particle_grid::Lattice;

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let num = |k: usize, d: f64| a.get(k).and_then(|s| s.parse().ok()).unwrap_or(d);
    let has = |w: &str| a.iter().any(|s| s == w);
    let (mu, dt, kappa) = (num(1, 1e5), num(2, 2e-3), num(3, 1e9));
    let lattice = Lattice::<2>::new(5e-3);
    let mut l = Liquid::preset("shaving-cream").unwrap();
    l.density = 1000.0;
    l.bulk_modulus = kappa;
    l.shear_modulus = mu;
    l.flow = FlowCurve::J2 { yield_stress: 1e9, consistency: 1.0, index: 1.0 };
    let mut m = LiquidMaterial::new(&l, LawSettings::default()).unwrap();
    m.shear_damping = 0.0;
    m.tearing_strain = None;
    m.recovery_time = None;
    if has("rigid") { m.rigid_volume = true; }
    let materials = vec![m];
    let v = fill::sample_volume(&lattice, 3);
    let mut p = Particles::new(&materials);
    let mut add = |lo: [f64; 2], hi: [f64; 2], vel: [f64; 2]| {
        for x in fill::fill(&lattice, 3, &Vector::<2>::new(lo[0], lo[1]), &Vector::<2>::new(hi[0], hi[1]), |_| true) {
            let mut q = Particle::new(x, v, 0, 1000.0);
            q.velocity = Vector::<2>::new(vel[0], vel[1]);
            if has("spin") { q.affine = nalgebra::Matrix2::new(0.0, -5.0, 5.0, 0.0); q.velocity = Vector::<2>::new(-5.0 * x.y, 5.0 * x.x); }
            if has("stretch") { q.affine = nalgebra::Matrix2::new(1.0, 0.0, 0.0, -1.0); q.velocity = Vector::<2>::new(x.x, - x.y); }
            p.push(q);
        }
    };
    if has("one") { add([-0.02, -0.01], [0.02, 0.01], [0.0, 0.0]); } else {
        add([-0.02, -0.01], [0.0, 0.01], [0.1, 0.0]);
        add([0.0, -0.01], [0.02, 0.01], [-0.1, 0.05]);
    }
    let mut s = LiquidSettings { particles_per_axis: 3, ..Default::default() };
    if has("nopressure") { s.pressure.enabled = false; }
    if has("particles") { s.shear.operator = ShearOperator::Particles; }
    if has("cells") { s.shear.operator = ShearOperator::CellQuadrature; }
    if has("definite") { s.shear.tangent = Tangent::PositiveDefinite; }
    if has("newton1") { s.shear.newton_iterations = 1; }
    if has("newton12") { s.shear.newton_iterations = 12; s.shear.newton_tolerance = 1e-6; }
    if has("nopredict") { s.pressure.predict = false; }
    if has("twice") { s.shear.after_pressure = true; }
    if has("projected") { s.shear.after_pressure = true; s.pressure.project_last = true; }
    if has("noresample") { s.resample.enabled = false; }
    if has("noadvect") { s.advection = false; }
    let mut st = LiquidStepper::new(lattice);
    let body = Vector::<2>::zeros();
    let none: [NoSolid; 0] = [];
    let steps = (0.1 / dt).round() as usize;
    for k in 0..=steps {
        let t = p.totals(&materials, lattice.dx);
        if k % (steps / 25).max(1) == 0 || k < 4 {
            println!("{:.4} kin {:.3e} el {:.3e} sum {:.4e} vmax {:.3e} am {:.3e}", k as f64 * dt, t.kinetic_energy, t.elastic_energy, t.kinetic_energy + t.elastic_energy, t.max_speed, t.angular_momentum[0]);
        }
        match st.advance(&mut p, &materials, &none, &none, &body, dt, k as u64, &s) {
            Ok(r) => if has("verbose") { println!("  {:?} newton {} res {:.1e} its {} fell {} rel {}", r.shear.solve.status, r.shear.newton_iterations, r.shear.nonlinear_residual, r.shear.solve.iterations, r.shear.fell_back, r.rounds) },
            Err(e) => { println!("error at {k}: {e}"); break; }
        }
    }
}
