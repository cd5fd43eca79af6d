//! Onsets of instability, each found twice: by the smallest eigenvalue of the exact stiffness and by watching a run.

use super::reference::{greenhill_column, lateral_buckling, michell_twist, twisted_rod_moment};
use super::setup::{
    Family, GRAVITY, Member, THIN, V, cantilever, observed_order, report_order, resolutions, thin_material, thin_weight,
};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use rods::{Boundary, FixedAngle, FixedEdge, FixedVertex, RodSet, StrandSpec};
use std::f64::consts::{PI, TAU};

const VERTICES: Param = Param::count("vertices", 41, "vertices of the finest rod");
const DYNAMIC: Param = Param::flag("dynamic", true, "also find the onset by perturbed dynamic runs");

/// Pinned column.
pub const EULER: Case = Case {
    id: "rods/euler-buckling",
    about: "A pinned column buckles at P L^2 / (E I) = pi^2.",
    params: &[VERTICES, DYNAMIC, Param::number("length", 1.0, "m", "length")],
    run: run_euler,
};

/// Column under its own weight.
pub const SELF_WEIGHT: Case = Case {
    id: "rods/self-buckling",
    about: "A standing column buckles under its own weight at rho g A L^3 / (E I) = 7.8373 (Greenhill); reference by shooting.",
    params: &[VERTICES, DYNAMIC],
    run: run_self_weight,
};

/// Deep cantilever.
pub const LATERAL: Case = Case {
    id: "rods/lateral-buckling",
    about: "A deep cantilever under an end load tips over at P L^2 / sqrt(EI GJ) = 4.0126 for a deep strip; reference by shooting.",
    params: &[VERTICES, DYNAMIC, Param::number("aspect", 30.0, "1", "height over width of the elliptic section")],
    run: run_lateral,
};

/// Twisted ring.
pub const MICHELL: Case = Case {
    id: "rods/michell-ring",
    about: "A ring of a naturally straight rod leaves its plane at the total twist 2 pi sqrt(3) EI / GJ (Michell, Zajac).",
    params: &[
        Param::count("vertices", 81, "vertices round the finest ring"),
        DYNAMIC,
        Param::number("poisson_ratio", 0.3, "1", "Poisson's ratio: EI / GJ = 1 + nu for a circular section"),
    ],
    run: run_michell,
};

/// Twisted straight rod under tension.
pub const TWISTED: Case = Case {
    id: "rods/twisted-greenhill",
    about: "A long clamped rod under tension T buckles under the twisting moment 2 sqrt(EI T) (Greenhill); finite length by its exact condition.",
    params: &[
        Param::count("vertices", 81, "vertices of the finest rod"),
        DYNAMIC,
        Param::number("tension", 400.0, "1", "T L^2 / (E I)"),
    ],
    run: run_twisted,
};

/// Onsets on four resolutions against a reference, and the dynamic one on the finest but one.
fn study<F: Fn(f64) -> Result<Member, CaseError>>(
    p: &Params,
    out: &mut Outcome,
    reference: f64,
    counts: [usize; 4],
    tolerance: f64,
    name: &str,
    family: impl Fn(usize) -> Family<F>,
) -> Result<(), CaseError> {
    let mut errors = Vec::new();
    let mut finest = f64::NAN;
    for n in counts {
        finest = family(n).static_onset(0.5 * reference, 2.0 * reference, 1e-7)?;
        errors.push((1.0 / (n as f64 - 1.0), (finest / reference - 1.0).abs()));
    }
    out.compare(name, finest, reference, tolerance);
    report_order(out, name, &errors, 1e-6);
    if p.flag("dynamic")? {
        let seen = family(counts[3]).dynamic_onset(finest, [0.04, 0.08])?;
        out.compare(&format!("{name}_dynamic"), seen, finest, 0.02);
    }
    Ok(())
}

/// Limit of zero spacing by Richardson's extrapolation of the two finest values, second order assumed.
fn extrapolated(values: &[(f64, f64)]) -> f64 {
    let [.., (h2, f2), (h1, f1)] = values else { return f64::NAN };
    f1 + (f1 - f2) / ((h2 / h1).powi(2) - 1.0)
}

/// Looser on coarse rods, as the square of the spacing.
fn coarse(vertices: usize, at: usize) -> f64 {
    ((at as f64 - 1.0) / (vertices as f64 - 1.0)).max(1.0).powi(2)
}

fn run_euler(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 17, 501)?;
    let length = p.positive("length")?;
    let bending = 1e-3;
    let mut out = Outcome::new();
    let family = |n: usize| Family {
        build: move |load: f64| {
            let mut material = thin_material(bending);
            material.young_modulus /= length.powi(4);
            let spec = StrandSpec::straight(V::zeros(), V::x() * length, n, THIN * length, material);
            let mut rods = RodSet::new();
            rods.add_strand(&spec).map_err(CaseError::failed)?;
            let mut boundary = Boundary::default();
            boundary.fix_vertex(0, V::zeros());
            boundary.vertices.push(FixedVertex {
                vertex: n - 1,
                position: V::zeros(),
                components: [false, true, true],
            });
            boundary.edges.push(FixedEdge { edge: 0, angle: FixedAngle::Angle(0.0) });
            let mut force = vec![V::zeros(); n];
            force[n - 1].x = -load * bending / (length * length);
            Ok(Member { rods, gravity: V::zeros(), force, boundary, symmetric: None })
        },
    };
    study(p, &mut out, PI * PI, resolutions(n), 0.01 * coarse(n, 41), "load", family)?;
    Ok(out)
}

fn run_self_weight(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 17, 501)?;
    let mut out = Outcome::new();
    let family = |n: usize| Family {
        build: move |gamma: f64| {
            let c = cantilever(n, V::z(), thin_material(thin_weight()), |_, _| ())?;
            let gravity = V::new(0.0, 0.0, -GRAVITY * gamma);
            Ok(Member { rods: c.rods, gravity, force: vec![V::zeros(); n], boundary: c.boundary, symmetric: None })
        },
    };
    study(p, &mut out, greenhill_column(), resolutions(n), 0.01 * coarse(n, 41), "gamma", family)?;
    Ok(out)
}

fn run_lateral(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 17, 501)?;
    let aspect = p.number_in("aspect", 8.0, 100.0)?;
    let mut out = Outcome::new();
    let material = thin_material(1e-3);
    // semi-axis a along the load (m1), b across
    let (a, b) = (THIN * aspect.sqrt(), THIN / aspect.sqrt());
    let weak = material.young_modulus * PI / 4.0 * a * b.powi(3);
    let torsion = material.shear_modulus() * PI * (a * b).powi(3) / (a * a + b * b);
    let unit = (weak * torsion).sqrt();
    let family = |n: usize| Family {
        build: move |load: f64| {
            let c = cantilever(n, V::x(), material, |spec, _| {
                spec.radii = vec![[a, b]];
                spec.director = Some(V::z());
            })?;
            let mut force = vec![V::zeros(); n];
            force[n - 1].z = -load * unit;
            // the fundamental equilibrium bends in the plane of the load
            let mut symmetric = c.boundary.clone();
            for vertex in 2..n {
                let components = [false, true, false];
                symmetric.vertices.push(FixedVertex { vertex, position: V::zeros(), components });
            }
            for edge in 1..n - 1 {
                symmetric.edges.push(FixedEdge { edge, angle: FixedAngle::Angle(0.0) });
            }
            Ok(Member { rods: c.rods, gravity: V::zeros(), force, boundary: c.boundary, symmetric: Some(symmetric) })
        },
    };
    // a section of finite height bends before it tips, which raises the load by 1/√((1 − EI_w/EI_s)(1 − GJ/EI_s)), the
    // classical correction for uniform bending; for a cantilever it is right to first order only
    let strong = weak * aspect * aspect;
    let finite = 1.0 / ((1.0 - weak / strong) * (1.0 - torsion / strong)).sqrt();
    out.note(
        "reference: infinitely deep strip; the correction for the section's finite height is within the tolerance",
    );
    let mut onsets = Vec::new();
    for m in resolutions(n) {
        let onset = family(m).static_onset(0.5 * lateral_buckling(), 2.0 * lateral_buckling(), 1e-8)?;
        onsets.push((1.0 / (m as f64 - 1.5), onset));
    }
    let finest = onsets[3].1;
    out.compare("load", finest, lateral_buckling(), 0.02 * coarse(n, 41) + 1.5 * (finite - 1.0));
    // the finite section shifts the limit, so the order is seen against the extrapolated one
    let limit = extrapolated(&onsets);
    out.info("load_extrapolated", limit);
    out.info("load_finite_section", lateral_buckling() * finite);
    let errors: Vec<(f64, f64)> = onsets[..3].iter().map(|(h, g)| (*h, (g / limit - 1.0).abs())).collect();
    report_order(&mut out, "load", &errors, 1e-7);
    if p.flag("dynamic")? {
        let seen = family(n).dynamic_onset(finest, [0.04, 0.08])?;
        out.compare("load_dynamic", seen, finest, 0.02);
    }
    Ok(out)
}

fn run_michell(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 33, 501)?;
    let poisson = p.number_in("poisson_ratio", -0.5, 0.5)?;
    let mut out = Outcome::new();
    let family = |n: usize| Family {
        build: move |twist: f64| {
            // the last edge lies on the first, so that the closed ring has n − 1 distinct edges
            let sides = n - 1;
            let radius = 1.0 / TAU;
            let corner = |i: usize| {
                let a = TAU * i as f64 / sides as f64;
                V::new(radius * a.cos(), radius * a.sin(), 0.0)
            };
            let mut material = thin_material(1e-3);
            material.poisson_ratio = poisson;
            let positions: Vec<V> = (0..=sides + 1).map(corner).collect();
            let mut spec =
                StrandSpec::new(positions, THIN, material).with_rest(rods::RestShape::Straight).with_director(V::z());
            spec.twist_angles = Some((0..=sides).map(|j| twist * j as f64 / sides as f64).collect());
            let mut rods = RodSet::new();
            rods.add_strand(&spec).map_err(CaseError::failed)?;
            let mut boundary = Boundary::default();
            boundary.clamp(&rods, 0, rods::End::Root);
            boundary.clamp(&rods, 0, rods::End::Tip);
            // the ring can turn about its clamped tangent without energy (its sections turn back): the opposite corner
            // is kept in the plane, which takes that freedom away and nothing else
            let components = [false, false, true];
            boundary.vertices.push(FixedVertex { vertex: sides / 2, position: V::zeros(), components });
            // on the fundamental branch the ring stays in its plane
            let mut symmetric = boundary.clone();
            for vertex in 0..sides + 2 {
                symmetric.vertices.push(FixedVertex {
                    vertex,
                    position: rods.position[vertex],
                    components: [vertex < 2 || vertex >= sides, vertex < 2 || vertex >= sides, true],
                });
            }
            let force = vec![V::zeros(); sides + 2];
            Ok(Member { rods, gravity: V::zeros(), force, boundary, symmetric: Some(symmetric) })
        },
    };
    let reference = michell_twist(1.0 + poisson);
    study(p, &mut out, reference, resolutions(n), 0.02 * coarse(n, 81), "twist", family)?;
    Ok(out)
}

fn run_twisted(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 33, 501)?;
    let tension = p.number_in("tension", 20.0, 4000.0)?;
    if (n as f64 - 1.0) < 3.0 * tension.sqrt() {
        return Err(p.reject("vertices", "at least three edges per length sqrt(EI/T)"));
    }
    let mut out = Outcome::new();
    let bending = 1e-3;
    let finite = twisted_rod_moment(tension).ok_or_else(|| p.reject("tension", "a tension with a known onset"))?;
    let infinite = 2.0 * tension.sqrt();
    let family = |n: usize| Family {
        build: move |moment: f64| {
            // effective clamps at the middles of the first and the last edge
            let edge = 1.0 / (n as f64 - 2.0);
            let material = thin_material(bending);
            let mut spec = StrandSpec::straight(V::x() * (-0.5 * edge), V::x() * (1.0 + 0.5 * edge), n, THIN, material)
                .with_director(V::z())
                .with_rest(rods::RestShape::Straight);
            // bending stiffness is 1 unit, so the twisting stiffness is GJ/EI = 1/(1+ν)
            let total = moment * (1.0 + material.poisson_ratio);
            spec.twist_angles = Some((0..n - 1).map(|j| total * j as f64 / (n as f64 - 2.0)).collect());
            let mut rods = RodSet::new();
            rods.add_strand(&spec).map_err(CaseError::failed)?;
            let mut boundary = Boundary::default();
            boundary.clamp(&rods, 0, rods::End::Root);
            boundary.clamp(&rods, 0, rods::End::Tip);
            for f in boundary.vertices.iter_mut().filter(|f| f.vertex + 2 >= n) {
                f.components = [false, true, true];
            }
            let mut force = vec![V::zeros(); n];
            force[n - 1].x = tension * bending;
            let mut symmetric = boundary.clone();
            for vertex in 2..n - 2 {
                let components = [false, true, true];
                symmetric.vertices.push(FixedVertex { vertex, position: V::zeros(), components });
            }
            Ok(Member { rods, gravity: V::zeros(), force, boundary, symmetric: Some(symmetric) })
        },
    };
    study(p, &mut out, finite * infinite, resolutions(n), 0.03 * coarse(n, 81), "moment", family)?;
    out.info("moment_infinite_rod", infinite);
    Ok(out)
}

/// Hanging naturally curved rod.
pub const BEND_TWIST: Case = Case {
    id: "rods/bend-twist",
    about: "A hanging, naturally curved rod: the weight at which the planar hook gives way to a three-dimensional shape, found twice, under refinement and rescaling (no published number).",
    params: &[
        Param::number("curvature", 8.0, "1", "natural curvature times length"),
        Param::count("vertices", 81, "vertices of the finest rod"),
        DYNAMIC,
    ],
    run: run_bend_twist,
};

/// A curved rod clamped upright at its root, hanging down, of total length `length`; the load parameter is `ρ g A L³/EI`.
fn hook(n: usize, curvature: f64, length: f64) -> Family<impl Fn(f64) -> Result<Member, CaseError>> {
    Family {
        build: move |gamma: f64| {
            // the same material for every length: gravity carries the load parameter
            let material = thin_material(thin_weight());
            let edge = length / (n as f64 - 1.5);
            let k = curvature / length;
            // start from the stress-free arc, which bends away from the vertical clamp in the plane y = 0
            let turn = k * edge;
            let mut positions = vec![V::new(0.0, 0.0, 0.5 * edge), V::new(0.0, 0.0, -0.5 * edge)];
            for i in 1..n - 1 {
                let a = turn * i as f64;
                let last = positions[i];
                positions.push(last + V::new(a.sin(), 0.0, -a.cos()) * edge);
            }
            let mut spec = StrandSpec::new(positions, THIN * length, material);
            spec.director = Some(V::x());
            let mut rods = RodSet::new();
            rods.add_strand(&spec).map_err(CaseError::failed)?;
            let mut boundary = Boundary::default();
            boundary.clamp(&rods, 0, rods::End::Root);
            let mut symmetric = boundary.clone();
            for vertex in 2..n {
                let components = [false, true, false];
                symmetric.vertices.push(FixedVertex { vertex, position: V::zeros(), components });
            }
            for e in 1..n - 1 {
                symmetric.edges.push(FixedEdge { edge: e, angle: FixedAngle::Angle(rods.twist_angle[e]) });
            }
            // EI/(ρ A L³) of this rod: E r²/(4 ρ L³)
            let r = THIN * length;
            let unit = material.young_modulus * r * r / (4.0 * material.density * length.powi(3));
            let gravity = V::new(0.0, 0.0, -gamma * unit);
            Ok(Member { rods, gravity, force: vec![V::zeros(); n], boundary, symmetric: Some(symmetric) })
        },
    }
}

/// First weight at which the planar hook is unstable, bracketed on a logarithmic scan and refined.
fn hook_onset(n: usize, curvature: f64, length: f64) -> Result<f64, CaseError> {
    let family = hook(n, curvature, length);
    let mut low = 0.0;
    for k in 0..60 {
        let gamma = 0.5 * 1.2f64.powi(k);
        let m = family.at(gamma)?;
        if m.rods.unstable_modes(0, &m.loads(), &m.boundary) > 0 {
            if low == 0.0 {
                return Err(CaseError::failed("the hook is unstable without weight"));
            }
            return family.static_onset(low, gamma, 1e-6);
        }
        low = gamma;
    }
    Err(CaseError::failed(format!("the planar hook stays stable up to a weight of {low}")))
}

fn run_bend_twist(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("vertices", 21, 401)?;
    let curvature = p.number_in("curvature", 5.0, 30.0)?;
    let mut out = Outcome::new();
    let mut onsets = Vec::new();
    for m in resolutions(n) {
        onsets.push((1.0 / (m as f64 - 1.5), hook_onset(m, curvature, 1.0)?));
    }
    let finest = onsets[3].1;
    out.info("gamma", finest);
    let change = (onsets[3].1 / onsets[2].1 - 1.0).abs();
    // the limit by Richardson's extrapolation of the two finest, and the order seen against it
    let limit = extrapolated(&onsets);
    out.info("gamma_extrapolated", limit);
    let errors: Vec<(f64, f64)> = onsets[..3].iter().map(|(h, g)| (*h, (g / limit - 1.0).abs())).collect();
    out.measure("order_gamma", observed_order(&errors, 1e-6), |o| o > 1.5, "an observed order above 1.5");
    out.measure("refinement_change", change, |c| c < 0.05, "onset changes by less than 5 % from the next coarser rod");
    out.table(Table {
        title: "weight at the onset against edge length".into(),
        columns: vec!["edge length / rod length".into(), "rho g A L^3 / (E I)".into()],
        rows: onsets.iter().map(|(h, g)| vec![format!("{h:.5}"), format!("{g:.5}")]).collect(),
    });
    let rescaled = hook_onset(n, curvature, 0.01)?;
    out.compare("gamma_rescaled", rescaled, finest, 1e-4);
    if p.flag("dynamic")? {
        let seen = hook(n, curvature, 1.0).dynamic_onset(finest, [0.03, 0.06])?;
        out.compare("gamma_dynamic", seen, finest, 0.02);
    }
    Ok(out)
}
