//! The presets by name. The values live with the laws that use them, in `constitutive::presets`.

pub use constitutive::presets::{FIBRE_NAMES, Fibre as FibrePreset, LIQUID_NAMES, Liquid as LiquidProperties};

/// A fibre preset by its exact name \[SI\].
#[must_use]
pub fn fibre(name: &str) -> Option<FibrePreset> {
    FIBRE_NAMES.contains(&name).then(|| FibrePreset::preset(name).ok()).flatten()
}

/// A liquid preset by its exact name \[SI\].
#[must_use]
pub fn liquid(name: &str) -> Option<LiquidProperties> {
    LIQUID_NAMES.contains(&name).then(|| LiquidProperties::preset(name).ok()).flatten()
}
