//! The presets by name, in SI.
//!
//! Fibres after the defaults of Fei et al. 2019 (hair, brush, noodle); liquids after its material table S14 with the
//! corrections listed in `docs/errata.md`.

use super::materials::{FibreProperties, FlowProperties, FlowReading, LiquidProperties};

/// A fibre preset: its material and the radius its strands usually have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibrePreset {
    /// Name.
    pub name: &'static str,
    /// Material values [SI].
    pub properties: FibreProperties,
    /// Usual radius [m].
    pub radius: f64,
}

const fn fibre_preset(
    name: &'static str,
    density: f64,
    young_modulus: f64,
    poisson_ratio: f64,
    viscosity: f64,
    radius: f64,
) -> FibrePreset {
    let properties = FibreProperties { density, young_modulus, poisson_ratio, viscosity, stretch_factor: 1.0 };
    FibrePreset { name, properties, radius }
}

/// All fibre presets.
pub const FIBRES: [FibrePreset; 3] = [
    fibre_preset("hair", 1320.0, 3.7e9, 0.37, 3.7e7, 5e-5),
    fibre_preset("brush", 1320.0, 2.98e9, 0.37, 3.7e7, 1.25e-4),
    fibre_preset("noodle", 1000.0, 1e5, 0.37, 4e4, 5.6e-4),
];

/// A fibre preset by name.
#[must_use]
pub fn fibre(name: &str) -> Option<&'static FibrePreset> {
    FIBRES.iter().find(|preset| preset.name == name)
}

/// The names of all fibre presets.
#[must_use]
pub fn fibre_names() -> Vec<&'static str> {
    FIBRES.iter().map(|preset| preset.name).collect()
}

struct LiquidRow {
    name: &'static str,
    density: f64,
    bulk_modulus: f64,
    shear_modulus: f64,
    reading: FlowReading,
    yield_stress: f64,
    consistency: f64,
    index: f64,
    surface_tension: f64,
    tearing_strain: f64,
}

const fn row(
    name: &'static str,
    [density, bulk_modulus, shear_modulus, yield_stress, consistency, index]: [f64; 6],
    reading: FlowReading,
    surface_tension: f64,
    tearing_strain: f64,
) -> LiquidRow {
    LiquidRow {
        name,
        density,
        bulk_modulus,
        shear_modulus,
        reading,
        yield_stress,
        consistency,
        index,
        surface_tension,
        tearing_strain,
    }
}

/// The table in CGS as printed (density, bulk modulus, shear modulus, yield stress, consistency, index), then the
/// reading, the surface tension [dyn/cm] and the tearing strain.
const LIQUIDS: [LiquidRow; 11] = [
    row("water", [1.0, 2.0e10, 0.0, 0.0, 8.9e-3, 1.0], FlowReading::Rheometer, 72.8, 1e8),
    row("tetrachloroethylene", [1.622, 3.1e10, 0.0, 0.0, 8.9e-3, 1.0], FlowReading::Rheometer, 31.7, 1e8),
    row("drilling-mud", [1.22, 2.0e10, 1.0e3, 16.813, 6.49, 0.5173], FlowReading::J2, 20.6, 10.0),
    row("drilling-mud-v2", [1.22, 2.0e10, 1.0e3, 30.6, 1.259, 0.8175], FlowReading::J2, 20.6, 10.0),
    row("acrylic-paint", [0.95, 1.35e9, 4.0e3, 9.6, 173.56, 0.3162], FlowReading::J2, 20.6, 217.5),
    row("milk-cream", [0.275, 1.09e6, 1.6e4, 1.2e3, 50.0, 0.27], FlowReading::J2, 20.6, 10.0),
    row("shaving-cream", [0.2, 1.09e6, 2.9e3, 3.19e2, 2.72e2, 0.22], FlowReading::J2, 20.6, 217.5),
    row("oyster-sauce", [1.207, 2.0e10, 4.0e3, 26.5, 16.1, 0.62], FlowReading::J2, 20.6, 217.5),
    row("milk-chocolate", [0.95, 4.28e6, 4.0e3, 3.0e2, 28.0, 0.98], FlowReading::J2, 20.6, 217.5),
    row("chocolate-dense", [1.27, 1.35e9, 5.0e3, 3.0e2, 28.0, 0.98], FlowReading::J2, 20.6, 217.5),
    row("mayonnaise", [1.2, 2.0e10, 1.0e4, 75.4, 447.2, 0.316], FlowReading::J2, 20.6, 217.5),
];

/// A liquid preset by name [SI].
#[must_use]
pub fn liquid(name: &str) -> Option<LiquidProperties> {
    let row = LIQUIDS.iter().find(|row| row.name == name)?;
    Some(LiquidProperties {
        density: row.density * 1000.0,
        bulk_modulus: row.bulk_modulus / 10.0,
        shear_modulus: row.shear_modulus / 10.0,
        flow: FlowProperties {
            reading: row.reading,
            yield_stress: row.yield_stress / 10.0,
            consistency: row.consistency / 10.0,
            index: row.index,
        },
        surface_tension: row.surface_tension / 1000.0,
        contact_angle: 60f64.to_radians(),
        tearing_strain: row.tearing_strain,
        recovery_time: 0.35,
    })
}

/// The names of all liquid presets.
#[must_use]
pub fn liquid_names() -> Vec<&'static str> {
    LIQUIDS.iter().map(|row| row.name).collect()
}
