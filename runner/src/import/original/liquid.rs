//! `liquidinfo`: what the liquid is and how it is computed.

use super::{Element, Number, Sited, flag_or, list, number_or, only_if};
use crate::import::document::Document;
use crate::import::notes::Heading;
use crate::scene::error::ProblemKind;

/// One liquid [CGS].
#[derive(Clone)]
pub struct Component {
    /// Density [g/cm³].
    pub density: Number,
    /// Bulk modulus [Ba].
    pub bulk_modulus: Number,
    /// Shear modulus [Ba].
    pub shear_modulus: Number,
    /// Yield stress, J2 reading [Ba].
    pub yield_stress: Number,
    /// Consistency, J2 reading [Ba sⁿ].
    pub consistency: Number,
    /// Flow index.
    pub index: Number,
    /// Surface tension [dyn/cm].
    pub surface_tension: Number,
    /// Plastic strain at which threads tear.
    pub tearing_strain: Number,
    /// Recovery time [s].
    pub recovery_time: Number,
}

/// The liquids and their numerics [CGS].
pub struct LiquidInfo {
    /// The liquids, by colour index; at least one.
    pub components: Vec<Component>,
    /// Contact angle [degrees].
    pub contact_angle: Number,
    /// Height of a captured film [cm].
    pub film_height: Number,
    /// Damping time [s].
    pub shear_damping: Number,
    /// Distance of particles relative to the cell.
    pub particle_spacing: Number,
    /// What solids do to liquid along them.
    pub boundary_friction: Number,
    /// Fraction of the affine velocity lost per step: its symmetric and its rotating part.
    pub affine_damping: [Option<Number>; 2],
    /// Fraction of the velocity lost per step.
    pub velocity_damping: Option<Number>,
    /// Relative residual of the shear solve.
    pub shear_tolerance: Number,
    /// Relative residual of the pressure solve.
    pub pressure_tolerance: Number,
    /// Most iterations of both.
    pub iterations: Option<Sited<i64>>,
    /// Strands capture liquid.
    pub capture: Sited<bool>,
    /// Strands and liquid drag each other.
    pub drag: Sited<bool>,
    /// The volume of strands counts.
    pub volume_fraction: Sited<bool>,
    /// Shear stress is computed.
    pub shear: Sited<bool>,
    /// Particles are relaxed every so many steps; 0: never.
    pub correction_step: Option<Sited<i64>>,
}

/// Names and built-in values of what a liquid is.
const OWN: [(&str, f64); 9] = [
    ("liquidDensity", 1.0),
    ("liquidBulkModulus", 1.09e6),
    ("liquidShearModulus", 2.9e3),
    ("plasticYieldStress", 319.0),
    ("flowConsistencyIndex", 272.0),
    ("flowBehaviorIndex", 0.22),
    ("surfTensionCoeff", 72.8),
    ("plasticWeakenStrain", 217.5),
    ("plasticRelaxCoeff", 0.35),
];

const NOT_HONOURED: &[(&str, &str)] = &[
    ("helmholtzFirstMinima", "liquids mix by volume only"),
    ("helmholtzSecondMinima", "liquids mix by volume only"),
    ("chemicalDiffusivity", "liquids do not diffuse"),
    ("geometricDiffusivity", "liquids do not diffuse"),
    ("geometricDragInsulation", "drag begins at the surface of the liquid"),
    ("levelsetYoungModulus", "strands do not push on liquid by a level set"),
    ("meshFlowEpsilon", "there are no films on solids"),
    ("meshFlowMaxHeight", "there are no films on solids"),
    ("meshFlowCriticalHeight", "there are no films on solids"),
    ("elastoCaptureRate", "strands capture what the model says"),
    ("correctionStrength", "particles are relaxed with the strength of the model, 10 per second"),
    ("correctionMultiplier", "particles are relaxed with the range of the model"),
];

const MACHINERY: &[(&str, &str)] = &[
    ("solidShellThickness", "friction on solids acts in one cell along them, as usual"),
    ("signedDistanceMultiplier", "resolution of the original's distance field"),
    ("thetaCriterion", "as in the model"),
    ("surfTensionSmoothingStep", "for the surface tension that is off"),
    ("iterationPrintStep", "the record has the iterations"),
];

impl LiquidInfo {
    /// Reads it; the section may be absent.
    #[must_use]
    pub fn read(root: &Element<'_, '_>) -> LiquidInfo {
        let document = root.document();
        let section = root.child("liquidinfo");
        let section = section.as_ref();
        let number = |name, default| number_or(section, document, "liquidinfo", name, default);
        let given = |name| section.and_then(|element| element.parameter_number(name));
        let whole = |name| section.and_then(|element| element.parameter_integer(name));
        let info = LiquidInfo {
            components: components(section, document),
            contact_angle: number("restContactAngle", 60.0),
            film_height: number("typicalFlowThickness", 0.05),
            shear_damping: number("liquidShearDamping", 1e-3),
            particle_spacing: number("particleCellMultiplier", 0.5),
            boundary_friction: number("liquidBoundaryFriction", 1.0),
            affine_damping: [given("affineStretchDamping"), given("affineRotateDamping")],
            velocity_damping: given("velocityDamping"),
            shear_tolerance: number("shearPcgCriterion", 1e-4),
            pressure_tolerance: number("pressurePcgCriterion", 1e-8),
            iterations: whole("pcgMaxIters"),
            capture: flag_or(section, "liquidCapture", true),
            drag: flag_or(section, "liquidDrag", true),
            volume_fraction: flag_or(section, "varyingVolumeFraction", true),
            shear: flag_or(section, "solveViscosity", true),
            correction_step: whole("correctionStep"),
        };
        if info.particle_spacing.value <= 0.0 {
            let message = format!("particleCellMultiplier must be above 0, found {}", info.particle_spacing.value);
            let help = "it is the distance of particles in cells, usually 0.25";
            document.problem(ProblemKind::OutOfRange, info.particle_spacing.span, message, help);
        }
        list(section, Heading::NotHonoured, NOT_HONOURED);
        list(section, Heading::Machinery, MACHINERY);
        let only = |name, usual, otherwise| {
            only_if(section, name, usual, Heading::NotHonoured, otherwise, "as here");
        };
        only("surfTension", false, "the bulk has no surface tension");
        only("implicitPressure", true, "pressure is always implicit");
        only("implicitElasticity", true, "elastic stress is always implicit");
        only("constantDrag", false, "drag follows the shear-dependent law");
        only("solveColorDiffusion", false, "liquids do not diffuse");
        only("solidAdhesion", true, "liquid sticks to solids as the model says");
        only("solidProjection", true, "particles are kept out of solids");
        info
    }

    /// The liquid of a colour index.
    #[must_use]
    pub fn component(&self, colour: usize) -> &Component {
        &self.components[colour.min(self.components.len() - 1)]
    }
}

fn components(section: Option<&Element<'_, '_>>, document: &Document<'_>) -> Vec<Component> {
    let count = section.and_then(|element| element.parameter_integer("numComponents")).unwrap_or(Sited::made(1));
    if !(1..=64).contains(&count.value) {
        let message = format!("numComponents must be from 1 to 64, found {}", count.value);
        document.problem(ProblemKind::OutOfRange, count.span, message, "it is the number of liquids");
    }
    let count = usize::try_from(count.value.clamp(1, 64)).unwrap_or(1);
    let columns = OWN.map(|(name, default)| column(section, document, name, default, count));
    (0..count)
        .map(|i| {
            let [
                density,
                bulk_modulus,
                shear_modulus,
                yield_stress,
                consistency,
                index,
                surface_tension,
                tearing_strain,
                recovery_time,
            ] = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|property: usize| columns[property][i]);
            Component {
                density,
                bulk_modulus,
                shear_modulus,
                yield_stress,
                consistency,
                index,
                surface_tension,
                tearing_strain,
                recovery_time,
            }
        })
        .collect()
}

/// One property of all liquids: `<name value="…"/>` for all, or one `<component value="…"/>` inside for each.
fn column(
    section: Option<&Element<'_, '_>>,
    document: &Document<'_>,
    name: &str,
    default: f64,
    count: usize,
) -> Vec<Number> {
    let mut values = vec![Sited::made(default); count];
    let Some(element) = section.and_then(|section| section.child(name)) else {
        document.assumed("liquidinfo", name, default);
        return values;
    };
    if element.text("value").is_some() {
        if let Some(number) = element.number("value") {
            values.fill(number);
        }
        return values;
    }
    let parts = element.children("component");
    if parts.is_empty() {
        let message = format!("liquidinfo/{name} has neither `value` nor components");
        document.problem(ProblemKind::MissingField, element.span(), message, format!("write `<{name} value=\"…\"/>`"));
    }
    for (i, part) in parts.iter().enumerate() {
        match (values.get_mut(i), part.number("value")) {
            (Some(place), Some(number)) => *place = number,
            (None, _) => {
                let message =
                    format!("liquidinfo/{name} has {} components, but there are {count} liquids", parts.len());
                document.problem(ProblemKind::Inconsistent, part.span(), message, "set numComponents");
                break;
            }
            (Some(_), None) => {}
        }
    }
    values
}
