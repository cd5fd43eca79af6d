//! A sample of soft grains in the rheometer: what it is made of, how it is prepared, and what is done to it.
//!
//! Defaults are those of the library; times, rates and frequencies are pure numbers, relative to the characteristic time
//! `sqrt(m/k)` of the grains, so that a scene says the same for any modulus.

use super::declare::{choice, section};
use super::quantity::{above, at_least};
use granular::experiment::Oscillation as OscillationSettings;
use granular::law::HERTZ_LAYERED;
use granular::model::ModelSettings;
use granular::physical::Rules;
use std::f64::consts::FRAC_PI_2;

choice! {
    /// Discs or spheres.
    pub enum GrainShape {
        /// Discs in the x–y plane, all quantities per metre of depth.
        Discs;
        /// Spheres in a box that is periodic in all directions.
        Spheres;
    }
}

choice! {
    /// How the two sizes of grains are distributed.
    pub enum GrainSizes {
        /// Exactly half of the grains large; the packing comes out as asked for.
        ExactHalf;
        /// Each grain large or small with equal chances.
        Random;
    }
}

section! {
    /// A sponge: it hardly resists further between two relative distances of the centres.
    pub struct PlateauLaw {
        /// Share of the diverging law.
        repulsion: f64 = [1.0] (Number, at_least(0.0).up_to(1.0)) "0 is linear outside the plateau.";
        /// Relative distance below which the sponge is crushed; smaller than `end`.
        begin: f64 = [0.5] (Number, above(0.0).below(1.0)) "";
        /// Relative distance at which the plateau starts under growing compression.
        end: f64 = [0.9] (Number, above(0.0).up_to(1.0)) "";
        /// Slope of the effective distance on the plateau.
        slope: f64 = [0.1] (Number, above(0.0).up_to(1.0)) "1 has no plateau.";
    }
}

section! {
    /// Force with the power 3/2 of the compression.
    pub struct HertzLaw {
        /// Factor on the force.
        coefficient: f64 = [HERTZ_LAYERED] (Number, above(0.0).up_to(1e6)) "The default is that of layers of spheres.";
    }
}

section! {
    /// A measured law, interpolated by monotone cubics and continued by a straight line.
    pub struct ForceTable {
        /// Relative compression, ascending from 0.
        compression: Vec<f64> = [required] (Number, at_least(0.0).up_to(1.0)) "";
        /// Force relative to the spring constant times the touching distance, ascending from 0.
        force: Vec<f64> = [required] (Number, at_least(0.0)) "";
    }
}

choice! {
    /// How grains resist compression. All laws but `Hertz` and `Table` start with the stiffness of `young_modulus`.
    pub enum CompressionLaw {
        /// A linear spring.
        Linear;
        /// A force that grows beyond all limits as the centres meet.
        Divergent;
        /// A blend: 0 is `Linear`, 1 is `Divergent`.
        Blend(f64) (Number, at_least(0.0).up_to(1.0));
        /// A sponge.
        Plateau(PlateauLaw) ();
        /// Hertzian contact.
        Hertz(HertzLaw) ();
        /// Measured.
        Table(ForceTable) ();
    }
}

choice! {
    /// How permanent links resist tension.
    pub enum LinkTension {
        /// A linear spring.
        Linear;
        /// A force that levels off at this relative extension.
        Saturating(f64) (Number, above(0.0).up_to(100.0));
    }
}

section! {
    /// Cut along the borders of Voronoi cells.
    pub struct VoronoiCut {
        /// Number of cells.
        points: usize = [5] (Number, at_least(0.0).up_to(1e6)) "As many particles; 0 and 1 leave one body.";
        /// Random addition to the distance that decides, in largest radii.
        edge_fuzziness: f64 = [0.0] (Number, at_least(0.0).up_to(100.0)) "Larger interlocks the particles more.";
    }
}

section! {
    /// Cut along straight lines.
    pub struct LineCut {
        /// Number of lines.
        count: usize = [3] (Number, at_least(0.0).up_to(1e4)) "";
        /// Lines closer to the horizontal than this are drawn again.
        avoid_horizontal: f64 = [0.0] (Angle, at_least(0.0).below(FRAC_PI_2)) "";
    }
}

choice! {
    /// How the linked sample is cut into particles.
    pub enum Cutting {
        /// Not at all: one body.
        Uncut;
        /// By Voronoi cells.
        Voronoi(VoronoiCut) ();
        /// By straight lines.
        Lines(LineCut) ();
    }
}

section! {
    /// From a random packing to a sample at rest.
    pub struct Preparation {
        /// Links all grains that touch after the first relaxation.
        links: bool = [true] () "Without, the sample is a paste of single grains.";
        /// How the linked sample is cut into particles.
        cut: Cutting = [Cutting::Voronoi(VoronoiCut { points: 5, edge_fuzziness: 0.0 })] () "";
        /// Cuts along the plates as well.
        cut_top_bottom: bool = [false] () "";
        /// Cuts again while a particle is taller than 0.9 of the box.
        avoid_tall: bool = [true] () "";
        /// Share of the links to remove at random where grains stay connected without them.
        remove_links: f64 = [0.0] (Number, at_least(0.0).up_to(1.0)) "More make particles softer.";
        /// Length of all relaxations relative to the published ones.
        relaxation: f64 = [1.0] (Number, at_least(0.01).up_to(100.0)) "Below 1 faster; the sample keeps stress and moves.";
    }
}

choice! {
    /// How the box ends.
    pub enum BoxEdges {
        /// Periodic, copies above and below move with the shear.
        LeesEdwards;
        /// Periodic and at rest; for compression.
        Periodic;
        /// Unbounded; for compression.
        Open;
        /// Periodic along the flow, flat rough walls below and above.
        Walls;
    }
}

choice! {
    /// How grains at the lower and upper edge are carried.
    pub enum PlateRule {
        /// Not at all: a bulk sample.
        Off;
        /// Those that touch a plate when the measurement begins.
        Fixed;
        /// Whoever touches a plate, from then on.
        Band;
    }
}

choice! {
    /// Whose rules the grains follow.
    pub enum GrainRules {
        /// Every contact once, spring kept at the Coulomb limit, independent of order.
        Physical;
        /// Those of the published program, with its faults, to reproduce its data.
        Compat;
    }
}

choice! {
    /// What happens when a step is too large for the stiffest contact.
    pub enum StepGuard {
        /// Nothing is checked.
        Off;
        /// It is cut into at most this many equal parts.
        SubStep(u32) (Number, at_least(1.0).up_to(1e6));
        /// The run stops.
        Refuse;
    }
}

section! {
    /// Details of the contacts in `mode: Physical`.
    pub struct ContactRules {
        /// Resets the tangential spring when a contact slips.
        reset_on_slip: bool = [false] () "The default keeps it stretched at the limit.";
        /// Takes the radius as lever of the contact speed, as published.
        radius_as_lever: bool = [false] () "Overlapping grains in rigid rotation then seem to slide.";
        /// Lets the dashpot of a separating contact pull.
        viscous_attraction: bool = [Rules::default().viscous_attraction] () "";
        /// Damps spins towards that of the flow instead of zero.
        damp_to_flow_spin: bool = [Rules::default().damp_to_flow_spin] () "";
        /// What happens when a step is too large.
        guard: StepGuard = [StepGuard::SubStep(4096)] () "";
        /// Largest step relative to `1/sqrt(stiffness (1/m₁ + 1/m₂))` of the stiffest contact.
        guard_fraction: f64 = [Rules::default().guard_fraction] (Number, at_least(0.02).up_to(0.5)) "Smaller is more accurate.";
        /// Skin of the list of pairs in mean radii.
        skin: f64 = [Rules::default().skin] (Number, at_least(0.02).up_to(2.0)) "Decides the cost, not the result.";
    }
}

section! {
    /// One sine of the strain.
    pub struct Sine {
        /// Strain amplitude.
        amplitude: f64 = [required] (Number, above(0.0).up_to(100.0)) "";
        /// Frequency times the characteristic time.
        relative_frequency: f64 = [required] (Number, above(0.0).up_to(0.25)) "A multiple of the first frequency keeps the sines apart.";
    }
}

section! {
    /// Oscillatory shear.
    pub struct Oscillation {
        /// Strain amplitude.
        amplitude: f64 = [OscillationSettings::default().amplitude] (Number, above(0.0).up_to(100.0)) "";
        /// Frequency times the characteristic time.
        relative_frequency: f64 = [OscillationSettings::default().relative_frequency] (Number, above(0.0).up_to(0.25)) "Lower is closer to rest and takes longer.";
        /// Further sines at the same time.
        overtones: Vec<Sine> = [Vec::new()] () "A frequency sweep at once, in the linear regime.";
        /// Periods of rest before.
        pre_periods: f64 = [OscillationSettings::default().pre_periods] (Number, at_least(0.0).up_to(1e4)) "";
        /// Periods of oscillation; with two or more the first is left out of the evaluation.
        periods: f64 = [OscillationSettings::default().periods] (Number, at_least(0.5).up_to(1e5)) "More give smaller standard errors.";
        /// Periods of rest afterwards.
        post_periods: f64 = [OscillationSettings::default().post_periods] (Number, at_least(0.0).up_to(1e4)) "";
        /// Factor on velocities against the flow per period.
        cool_factor: f64 = [OscillationSettings::default().cool_factor] (Number, above(0.0).up_to(1.0)) "1 takes no heat out.";
    }
}

section! {
    /// Oscillations of several amplitudes, one after the other on the same sample.
    pub struct AmplitudeSweep {
        /// Strain amplitudes, in order.
        amplitudes: Vec<f64> = [required] (Number, above(0.0).up_to(100.0)) "The smallest decides the step and the preparation.";
        /// Everything else.
        base: Oscillation = [blank] () "Its amplitude is not used.";
    }
}

section! {
    /// Oscillations of several frequencies, one after the other on the same sample.
    pub struct FrequencySweep {
        /// Frequencies times the characteristic time, in order.
        relative_frequencies: Vec<f64> = [required] (Number, above(0.0).up_to(0.25)) "";
        /// Everything else.
        base: Oscillation = [blank] () "Its frequency is not used.";
    }
}

section! {
    /// Shear at a constant rate.
    pub struct ShearRamp {
        /// Rate times the characteristic time; the sign is the direction.
        relative_rate: f64 = [0.01] (Number, at_least(-1.0).up_to(1.0)) "";
        /// Strain at the end.
        strain: f64 = [2.0] (Number, above(0.0).up_to(1e4)) "";
    }
}

section! {
    /// Sudden strain, then rest.
    pub struct StepStrain {
        /// Strain.
        strain: f64 = [0.1] (Number, at_least(-100.0).up_to(100.0)) "";
        /// Duration of the rise in characteristic times.
        rise: f64 = [10.0] (Number, above(0.0).up_to(1e9)) "";
        /// Rest afterwards in characteristic times.
        hold: f64 = [200.0] (Number, at_least(0.0).up_to(1e9)) "";
    }
}

section! {
    /// Constant shear stress, then none.
    pub struct Creep {
        /// Shear stress.
        stress: f64 = [required] (Pressure) "";
        /// Duration under stress in characteristic times.
        duration: f64 = [400.0] (Number, above(0.0).up_to(1e9)) "";
        /// Duration without stress in characteristic times.
        recovery: f64 = [200.0] (Number, at_least(0.0).up_to(1e9)) "";
    }
}

section! {
    /// The box closes from below and above, then rests.
    pub struct Compression {
        /// Height lost relative to the initial height.
        strain: f64 = [0.1] (Number, above(0.0).up_to(0.9)) "";
        /// Rate times the characteristic time.
        relative_rate: f64 = [0.001] (Number, at_least(1e-9).up_to(1.0)) "";
        /// Rest afterwards in characteristic times.
        hold: f64 = [100.0] (Number, at_least(0.0).up_to(1e9)) "";
    }
}

choice! {
    /// What is done to the sample.
    pub enum MicrogelExperiment {
        /// Oscillatory shear.
        Oscillation(Oscillation) ();
        /// Several amplitudes.
        AmplitudeSweep(AmplitudeSweep) ();
        /// Several frequencies.
        FrequencySweep(FrequencySweep) ();
        /// Constant rate; the last half counts.
        SteadyShear(ShearRamp) ();
        /// Constant rate; the overshoot counts.
        StartUp(ShearRamp) ();
        /// Relaxation after a sudden strain.
        StepStrain(StepStrain) ();
        /// Constant stress.
        Creep(Creep) ();
        /// A closing box.
        Compression(Compression) ();
    }
}

choice! {
    /// What is done about a linear drift of the stress.
    pub enum DriftRule {
        /// It is subtracted.
        Subtract;
        /// It is doubled, as in the published program.
        Double;
        /// It is left in.
        Keep;
    }
}

section! {
    /// Soft grains in the rheometer. No gravity acts; the experiment decides the time span and the step.
    pub struct Microgel {
        /// Discs or spheres.
        shape: GrainShape = [GrainShape::Discs] () "";
        /// Number of grains.
        grains: usize = [ModelSettings::default().grains] (Number, at_least(2.0).up_to(1e8)) "More have smaller errors of finite size; the cost is proportional.";
        /// Width of the box, along the flow.
        width: f64 = [500e-6] (Length, above(0.0)) "";
        /// Height of the box, along the gradient.
        height: f64 = [500e-6] (Length, above(0.0)) "";
        /// Depth of the box of spheres; default: the width.
        depth: Option<f64> = [None] (Length, above(0.0)) "";
        /// Area of the discs (volume of the spheres) over that of the box.
        packing: f64 = [ModelSettings::default().packing] (Number, at_least(0.01).up_to(4.0)) "Above 0.84 (discs) or 0.64 (spheres) grains press on each other.";
        /// Modulus of a grain.
        young_modulus: f64 = [ModelSettings::default().young_modulus] (Pressure, above(0.0)) "Stress is proportional to it.";
        /// Density of the grains.
        density: f64 = [ModelSettings::default().density] (Density, above(0.0)) "Decides the characteristic time with the modulus.";
        /// Ratio of the two radii.
        size_ratio: f64 = [ModelSettings::default().size_ratio] (Number, at_least(1.0).up_to(4.0)) "1 crystallises.";
        /// How the two sizes are distributed.
        sizes: GrainSizes = [GrainSizes::ExactHalf] () "";
        /// How grains resist compression.
        law: CompressionLaw = [CompressionLaw::Divergent] () "";
        /// How links resist tension.
        tension: LinkTension = [LinkTension::Linear] () "";
        /// Coulomb coefficient of contacts that are not linked.
        friction: f64 = [ModelSettings::default().friction] (Number, at_least(0.0).up_to(1000.0)) "";
        /// Viscosity of a contact relative to `sqrt(m k)`.
        relative_viscosity: f64 = [ModelSettings::default().relative_viscosity] (Number, at_least(0.0).up_to(100.0)) "Damping; much of it needs smaller steps.";
        /// Tangential over central stiffness.
        tangential_ratio: f64 = [ModelSettings::default().tangential_ratio] (Number, at_least(0.0).up_to(100.0)) "";
        /// Stiffness of contacts over that of links, centrally.
        reinforcement_central: f64 = [ModelSettings::default().reinforcement_central] (Number, above(0.0).up_to(1e4)) "";
        /// Stiffness of contacts over that of links, tangentially.
        reinforcement_tangential: f64 = [ModelSettings::default().reinforcement_tangential] (Number, above(0.0).up_to(1e4)) "";
        /// Leaves viscosities out of the reinforcement.
        keep_viscosity: bool = [ModelSettings::default().keep_viscosity] () "";
        /// From a random packing to a sample at rest.
        preparation: Preparation = [blank] () "";
        /// How the box ends.
        edges: BoxEdges = [BoxEdges::LeesEdwards] () "";
        /// How grains at the edges are carried; default: `Off` in physical, `Band` in compat mode.
        plates: Option<PlateRule> = [None] () "";
        /// Whose rules the grains follow.
        mode: GrainRules = [GrainRules::Physical] () "";
        /// Details of the contacts.
        rules: ContactRules = [blank] () "";
        /// What is done to the sample.
        experiment: MicrogelExperiment = [required] () "";
        /// Drift of the stress; default: `Subtract` in physical, `Double` in compat mode.
        drift: Option<DriftRule> = [None] () "";
        /// Number of samples with successive seeds, run in parallel.
        seeds: u32 = [1] (Number, at_least(1.0).up_to(100_000.0)) "Error bars shrink with its root; the record shows the first.";
        /// Factor on the published time step of the measurement; default: 4 in physical, 1 in compat mode.
        step_factor: Option<f64> = [None] (Number, at_least(1e-6).up_to(1000.0)) "Larger is faster and less exact; the guard cuts what is too large.";
        /// Steps of the grains per row of `series.csv` and `microgel.csv`.
        record_every: u64 = [10] (Number, at_least(1.0).up_to(1e9)) "1 gives the table as published; moduli always use every step.";
    }
}
