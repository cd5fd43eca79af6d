//! APIC transfers on staggered and collocated grids: what they conserve, what they reproduce, and that threads change nothing.

use numerics::tensor::{Tensor, Vector, moment, wedge};
use particle_grid::{
    BlockGrid, CENTRE, Contribution, Lanes, Lattice, ParticleOrder, ScatterScratch, gather, mac_offset, permute,
    scatter, stencil, sum_over_some,
};
use proptest::prelude::*;

struct Cloud<const D: usize> {
    x: Vec<Vector<D>>,
    v: Vec<Vector<D>>,
    c: Vec<Tensor<D>>,
    m: Vec<f64>,
}

/// A cheap deterministic stream of numbers in (0, 1).
fn stream(seed: u64) -> impl FnMut() -> f64 {
    let mut s = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        (s >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn cloud<const D: usize>(
    n: usize,
    size: f64,
    seed: u64,
    lattice: &Lattice<D>,
) -> (Cloud<D>, ParticleOrder<D>, BlockGrid<D>) {
    let mut r = stream(seed);
    let mut x: Vec<Vector<D>> = (0..n).map(|_| Vector::from_fn(|_, _| (r() - 0.3) * size)).collect();
    for x in &mut x {
        lattice.wrap(x);
    }
    let mut order = ParticleOrder::new();
    order.build(lattice, &x).unwrap();
    let index = order.index().to_vec();
    permute(&mut x, &index, &mut Vec::new());
    order.build(lattice, &x).unwrap();
    assert!(order.is_sorted());
    let v = (0..n).map(|_| Vector::from_fn(|_, _| r() - 0.5)).collect();
    let c = (0..n).map(|_| Tensor::from_fn(|_, _| 3.0 * (r() - 0.5))).collect();
    let m = (0..n).map(|_| 0.5 + r()).collect();
    let mut grid = BlockGrid::new(*lattice);
    grid.rebuild(&order, &[]);
    (Cloud { x, v, c, m }, order, grid)
}

/// Lanes: mass, momentum, nothing, nothing.
fn to_grid<const D: usize>(
    p: &Cloud<D>,
    order: &ParticleOrder<D>,
    grid: &BlockGrid<D>,
    offsets: &[[f64; D]; D],
) -> Vec<Vec<Lanes>> {
    let mut scratch = ScatterScratch::default();
    (0..D)
        .map(|a| {
            let mut out = vec![Lanes::ZERO; grid.node_count()];
            let give = |i: usize| Contribution {
                value: Lanes([p.m[i], p.m[i] * p.v[i][a], 0.0, 0.0]),
                gradient: std::array::from_fn(|b| Lanes([0.0, p.m[i] * p.c[i][(a, b)], 0.0, 0.0])),
            };
            scatter(grid, order, &p.x, &offsets[a], 0.0, give, &mut scratch, &mut out);
            out
        })
        .collect()
}

fn momenta<const D: usize>(p: &Cloud<D>, dx: f64) -> (f64, Vector<D>, [f64; 3]) {
    let (mut mass, mut linear, mut angular) = (0.0, Vector::zeros(), [0.0; 3]);
    for i in 0..p.x.len() {
        mass += p.m[i];
        linear += p.v[i] * p.m[i];
        let (orbit, spin) = (wedge(&p.x[i], &p.v[i]), moment(&(p.c[i] * (0.25 * dx * dx))));
        for k in 0..3 {
            angular[k] += p.m[i] * (orbit[k] + spin[k]);
        }
    }
    (mass, linear, angular)
}

fn grid_momenta<const D: usize>(
    grid: &BlockGrid<D>,
    fields: &[Vec<Lanes>],
    offsets: &[[f64; D]; D],
) -> ([f64; D], Vector<D>, [f64; 3]) {
    let (mut mass, mut linear, mut angular) = ([0.0; D], Vector::zeros(), [0.0; 3]);
    for a in 0..D {
        for node in 0..grid.node_count() {
            let x = grid.lattice.node_position(&grid.cell(node), &offsets[a]);
            let mut u = Vector::<D>::zeros();
            u[a] = fields[a][node].0[1];
            mass[a] += fields[a][node].0[0];
            linear += u;
            let l = wedge(&x, &u);
            for k in 0..3 {
                angular[k] += l[k];
            }
        }
    }
    (mass, linear, angular)
}

fn conserves<const D: usize>(offsets: [[f64; D]; D], seed: u64) {
    let mut lattice = Lattice::<D>::new(0.3);
    lattice.origin = Vector::from_fn(|a, _| 0.1 * a as f64 - 0.05);
    let (mut p, order, grid) = cloud::<D>(200, 4.0, seed, &lattice);
    let fields = to_grid(&p, &order, &grid, &offsets);
    let (mass, linear, angular) = momenta(&p, lattice.dx);
    let (grid_mass, grid_linear, grid_angular) = grid_momenta(&grid, &fields, &offsets);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * mass;
    for a in 0..D {
        assert!(close(mass, grid_mass[a]));
        assert!(close(linear[a], grid_linear[a]));
    }
    for k in 0..3 {
        assert!(close(angular[k], grid_angular[k]), "{angular:?} {grid_angular:?}");
    }
    let velocity: Vec<Vec<f64>> =
        fields.iter().map(|f| f.iter().map(|n| if n.0[0] > 0.0 { n.0[1] / n.0[0] } else { 0.0 }).collect()).collect();
    let slices: [&[f64]; D] = std::array::from_fn(|a| velocity[a].as_slice());
    gather(&grid, &order, &p.x, slices, offsets, &mut p.v, &mut p.c);
    let (_, linear, angular) = momenta(&p, lattice.dx);
    for a in 0..D {
        assert!(close(linear[a], grid_linear[a]));
    }
    for k in 0..3 {
        assert!(close(angular[k], grid_angular[k]), "back to particles: {angular:?} {grid_angular:?}");
    }
}

fn reproduces_affine<const D: usize>(offsets: [[f64; D]; D], seed: u64) {
    let lattice = Lattice::<D>::new(0.3);
    let (mut p, order, grid) = cloud::<D>(150, 3.0, seed, &lattice);
    let mut r = stream(seed + 7);
    let a = Tensor::<D>::from_fn(|_, _| r() - 0.5);
    let b = Vector::<D>::from_fn(|_, _| r());
    for i in 0..p.x.len() {
        p.v[i] = a * p.x[i] + b;
        p.c[i] = a;
    }
    let before = p.v.clone();
    let fields = to_grid(&p, &order, &grid, &offsets);
    let velocity: Vec<Vec<f64>> =
        fields.iter().map(|f| f.iter().map(|n| if n.0[0] > 0.0 { n.0[1] / n.0[0] } else { 0.0 }).collect()).collect();
    let slices: [&[f64]; D] = std::array::from_fn(|k| velocity[k].as_slice());
    gather(&grid, &order, &p.x, slices, offsets, &mut p.v, &mut p.c);
    for i in 0..p.x.len() {
        assert!((p.v[i] - before[i]).norm() < 1e-12);
        assert!((p.c[i] - a).norm() < 1e-11);
    }
}

fn mac<const D: usize>() -> [[f64; D]; D] {
    std::array::from_fn(mac_offset)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn momentum_is_conserved_both_ways(seed in 1u64..1_000_000) {
        conserves::<2>(mac(), seed);
        conserves::<3>(mac(), seed);
        conserves::<3>([[0.0; 3]; 3], seed);
        conserves::<2>([[CENTRE; 2]; 2], seed);
    }

    #[test]
    fn affine_fields_survive_a_round_trip(seed in 1u64..1_000_000) {
        reproduces_affine::<2>(mac(), seed);
        reproduces_affine::<3>(mac(), seed);
        reproduces_affine::<3>([[0.0; 3]; 3], seed);
    }
}

#[test]
fn the_tiled_scatter_equals_the_definition() {
    let lattice = Lattice { dx: 0.25, origin: Vector::<3>::new(0.0, 0.1, 0.0), periods: [1, 0, 2] };
    let (p, order, grid) = cloud::<3>(300, 3.0, 5, &lattice);
    let fields = to_grid(&p, &order, &grid, &mac());
    for a in 0..3 {
        let mut expected = vec![[0.0; 2]; grid.node_count()];
        for i in 0..p.x.len() {
            let total = stencil(&grid, &p.x[i], &mac_offset(a), |s| {
                expected[s.node][0] += s.weight * p.m[i];
                expected[s.node][1] += s.weight * p.m[i] * (p.v[i][a] + (p.c[i] * s.displacement)[a]);
            });
            assert!((total - 1.0).abs() < 1e-13, "every stencil is active");
        }
        for (f, e) in fields[a].iter().zip(&expected) {
            assert!((f.0[0] - e[0]).abs() < 1e-12 && (f.0[1] - e[1]).abs() < 1e-12);
        }
    }
}

#[test]
fn one_two_and_four_threads_give_the_same_bits() {
    let lattice = Lattice::<3>::new(0.1);
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let (mut p, order, grid) = cloud::<3>(40_000, 3.0, 3, &lattice);
            let fields = to_grid(&p, &order, &grid, &mac());
            let mass: Vec<Vec<f64>> = fields.iter().map(|f| f.iter().map(|n| n.0[1]).collect()).collect();
            let slices: [&[f64]; 3] = std::array::from_fn(|a| mass[a].as_slice());
            gather(&grid, &order, &p.x, slices, mac(), &mut p.v, &mut p.c);
            let bits: Vec<u64> = p.c.iter().flat_map(|c| c.iter().map(|x| x.to_bits())).collect();
            bits
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(4));
}

#[test]
fn neighbours_along_axes_agree_with_cell_coordinates() {
    let lattice = Lattice { dx: 0.25, origin: Vector::<2>::zeros(), periods: [2, 0] };
    let (_, _, grid) = cloud::<2>(100, 3.0, 9, &lattice);
    for node in 0..grid.node_count() {
        for axis in 0..2 {
            for steps in [-4, -1, 1, 2, 4] {
                let mut cell = grid.cell(node);
                cell[axis] += steps;
                assert_eq!(grid.along(node, axis, steps), grid.node(&cell));
            }
        }
    }
}

#[test]
fn nothing_to_do_is_no_error() {
    let lattice = Lattice::<3>::new(0.1);
    let mut order = ParticleOrder::new();
    order.build(&lattice, &[]).unwrap();
    let mut grid = BlockGrid::new(lattice);
    grid.rebuild(&order, &[]);
    assert_eq!(grid.node_count(), 0);
    scatter(&grid, &order, &[], &[0.0; 3], 0.0, |_| unreachable!(), &mut ScatterScratch::default(), &mut []);
    gather(&grid, &order, &[], [&[], &[], &[]], mac(), &mut [], &mut []);
    grid.rebuild(&order, &[Vector::<3>::new(1.0, 2.0, 3.0)]);
    assert_eq!(grid.block_count(), 27, "a point that is no particle brings its neighbourhood");
}

/// Asked at every particle, the sum is that of what `gather` gives; asked at some, that of every so many of each block.
#[test]
fn some_particles_stand_for_all() {
    let lattice = Lattice::<3>::new(0.3);
    let (mut p, order, grid) = cloud::<3>(300, 4.0, 5, &lattice);
    let offsets = [mac_offset(0), mac_offset(1), mac_offset(2)];
    let mut r = stream(8);
    let fields: Vec<Vec<f64>> = (0..6).map(|_| (0..grid.node_count()).map(|_| r()).collect()).collect();
    let set = |k: usize| -> [&[f64]; 3] { std::array::from_fn(|a| fields[3 * k + a].as_slice()) };
    let mut gradients = [p.c.clone(), p.c.clone()];
    for (k, of) in gradients.iter_mut().enumerate() {
        gather(&grid, &order, &p.x, set(k), offsets, &mut p.v, of);
    }
    for stride in [1, 7] {
        let judge = |i: usize, a: &Tensor<3>, b: &Tensor<3>| {
            assert!((a - gradients[0][i]).norm() + (b - gradients[1][i]).norm() < 1e-12);
            [1.0, a.norm() * b.norm()]
        };
        let [count, sum] = sum_over_some(&grid, &order, &p.x, stride, [set(0), set(1)], offsets, judge);
        let asked: Vec<usize> = (0..order.blocks().len()).flat_map(|b| order.block_range(b).step_by(stride)).collect();
        let expected: f64 = asked.iter().map(|&i| gradients[0][i].norm() * gradients[1][i].norm()).sum();
        assert_eq!(count, asked.len() as f64);
        assert!((sum - expected).abs() < 1e-12 * expected);
    }
}
