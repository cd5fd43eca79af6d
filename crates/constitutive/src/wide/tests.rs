use super::*;
use crate::presets::LIQUID_NAMES;
use crate::tearing;
use crate::{LawSettings, Liquid};
use numerics::lanes::{LaneKernel, dispatch, dispatch_portable};

/// Uniform numbers in (−1, 1).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as f64 / f64::from(1u32 << 30)) - 1.0
    }
    fn tensor<const D: usize>(&mut self, size: f64) -> Tensor<D> {
        Tensor::<D>::from_fn(|_, _| size * self.next())
    }
}

#[derive(Clone)]
struct Result4<const D: usize> {
    trial: [Tensor<D>; 4],
    relaxed: [Tensor<D>; 4],
    healed: [Tensor<D>; 4],
    numbers: [[f64; 4]; 6],
}

struct Everything<'a, const D: usize> {
    law: &'a HerschelBulkley,
    dt: f64,
    strain: &'a [Tensor<D>; 4],
    step: &'a [Tensor<D>; 4],
    gradient: &'a [Tensor<D>; 4],
    exponent: f64,
}

impl<const D: usize> LaneKernel for Everything<'_, D> {
    type Output = Result4<D>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) -> Result4<D> {
        let zero = [Tensor::<D>::zeros(); 4];
        let mut out = Result4 { trial: zero, relaxed: zero, healed: zero, numbers: [[0.0; 4]; 6] };
        let law = Law::<L>::new(self.law, self.dt);
        let trial = elastic_trial(&load::<D, L>(self.strain), &load(self.step));
        store(&trial.strain, &mut out.trial);
        let (relaxed, flowed) = law.relax(&trial.strain);
        store(&relaxed, &mut out.relaxed);
        let (healed, sound) = recover(&load::<D, L>(self.gradient), &relaxed, L::splat(self.exponent));
        store(&healed, &mut out.healed);
        out.numbers =
            [trial.sound, trial.factor, flowed.radial, flowed.radial_by_stress, flowed.radial_by_modulus, sound]
                .map(parts);
        out
    }
}

fn compare<const D: usize>() {
    let mut draw = Draw(7 + D as u64);
    let close = |a: f64, b: f64, size: f64| (a - b).abs() <= 2e-12 * size.max(b.abs());
    let (mut sound, mut all, mut yielded) = (0, 0, 0);
    for name in LIQUID_NAMES {
        let liquid = Liquid::preset(name).unwrap();
        let law = liquid.law(LawSettings::default()).unwrap();
        if !covers(&law) {
            assert_eq!(law.shear_modulus, 0.0, "{name}");
            continue;
        }
        for round in 0..200 {
            let dt = 10f64.powf(-3.5 + 2.0 * draw.next());
            let size = 10f64.powf(-2.0 + 1.9 * draw.next());
            let recovery_time = 0.35;
            let strain: [Tensor<D>; 4] = std::array::from_fn(|_| {
                let f = Tensor::<D>::identity() + draw.tensor::<D>(size.min(0.4));
                crate::liquid_law::elastic_trial(&Tensor::identity(), &f).map_or(Tensor::identity(), |t| t.strain)
            });
            let step: [Tensor<D>; 4] =
                std::array::from_fn(|_| Tensor::<D>::identity() + draw.tensor::<D>(size.min(0.3)));
            let mut gradient: [Tensor<D>; 4] = std::array::from_fn(|_| {
                let mut f = Tensor::<D>::identity();
                for _ in 0..round % 5 {
                    f = (Tensor::<D>::identity() + draw.tensor::<D>(0.4)) * f;
                }
                f
            });
            for g in &mut gradient {
                if crate::tensor::determinant(g) <= 0.01 {
                    *g = Tensor::identity();
                }
            }
            let exponent = 0.5 * (-dt / recovery_time).exp_m1();
            let work = || Everything { law: &law, dt, strain: &strain, step: &step, gradient: &gradient, exponent };
            let (wide, portable) = (dispatch(work()), dispatch_portable(work()));
            assert!(wide.relaxed == portable.relaxed && wide.healed == portable.healed);
            assert!(wide.numbers.map(|n| n.map(f64::to_bits)) == portable.numbers.map(|n| n.map(f64::to_bits)));
            for p in 0..4 {
                let Ok(trial) = crate::liquid_law::elastic_trial(&strain[p], &step[p]) else {
                    assert_eq!(wide.numbers[0][p], 0.0);
                    continue;
                };
                all += 1;
                if wide.numbers[0][p] == 0.0 {
                    continue;
                }
                sound += 1;
                let scale = trial.strain.norm();
                assert!(close(wide.numbers[1][p], trial.volume_factor, 1.0));
                assert!((wide.trial[p] - trial.strain).norm() <= 1e-12 * scale, "{name}");
                let relaxed = law.relax(&wide.trial[p], &strain[p], dt).unwrap();
                yielded += usize::from(relaxed.yielded);
                assert!((wide.relaxed[p] - relaxed.strain).norm() <= 1e-11 * scale, "{name} {:?}", relaxed);
                let det = crate::tensor::determinant(&wide.relaxed[p]);
                assert!((det - 1.0).abs() < 1e-12 * scale.powi(D as i32));
                let stress = law.shear_stress_norm(&wide.trial[p]).max(1e-300);
                assert!(close(wide.numbers[2][p], relaxed.radial, 0.0), "{name} {} {relaxed:?}", wide.numbers[2][p]);
                assert!((wide.numbers[3][p] - relaxed.radial_by_stress).abs() * stress <= 1e-10);
                assert!((wide.numbers[4][p] - relaxed.radial_by_modulus).abs() * law.shear_modulus <= 1e-10);
                if wide.numbers[5][p] == 1.0 {
                    let healed = tearing::recover(&gradient[p], &wide.relaxed[p], dt, recovery_time).unwrap();
                    let miss = (wide.healed[p] - healed).norm() / healed.norm();
                    assert!(miss <= 1e-11, "{name} {miss:e}");
                }
            }
        }
    }
    assert!(sound * 100 > 90 * all && yielded * 10 > all, "{sound} {yielded} of {all}");
}

#[test]
fn four_points_agree_with_the_law_of_one_in_the_plane() {
    compare::<2>();
}

#[test]
fn four_points_agree_with_the_law_of_one_in_space() {
    compare::<3>();
}

#[test]
fn healing_of_histories_with_equal_principal_values() {
    for stretch in [1.0, 1.0 + 1e-15, 1.0 + 1e-9, 1.001, 2.0] {
        let f = Tensor::<3>::from_diagonal(&nalgebra::Vector3::new(stretch, stretch, 1.0 / (stretch * stretch)));
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
        let gradient = [turn * f, f * turn, f, turn];
        let identity = [Tensor::<3>::identity(); 4];
        struct Heal<'a>(&'a [Tensor<3>; 4], &'a [Tensor<3>; 4], f64);
        impl LaneKernel for Heal<'_> {
            type Output = ([Tensor<3>; 4], [f64; 4]);
            #[inline(always)]
            fn run<L: Lane<Memory = F4>>(self) -> Self::Output {
                let mut out = *self.0;
                let (healed, sound) = recover(&load::<3, L>(self.0), &load(self.1), L::splat(self.2));
                store(&healed, &mut out);
                (out, parts(sound))
            }
        }
        let (healed, sound) = dispatch(Heal(&gradient, &identity, 0.5 * (-0.01f64 / 0.35).exp_m1()));
        assert_eq!(sound, [1.0; 4]);
        for p in 0..4 {
            let right = tearing::recover(&gradient[p], &identity[p], 0.01, 0.35).unwrap();
            assert!((healed[p] - right).norm() < 1e-13, "{stretch} {p}");
        }
    }
}
