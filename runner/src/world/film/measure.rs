//! Figures of the films for the record.

use serde_json::{Map, Value, json};

use super::{FilmWorld, Films};
use crate::system::Column;

/// Columns of the films.
pub fn columns(columns: &mut Vec<Column>) {
    for (name, unit, meaning) in [
        ("film_mass", "kg", "liquid in films"),
        ("reservoir_mass", "kg", "liquid waiting at the ends of strands"),
        ("dripped_mass", "kg", "liquid that fell in drops since the start"),
        ("dripped", "kg", "liquid that fell in drops in this step"),
        ("captured", "kg", "liquid that strands took up from bulk liquid in this step"),
        ("absorbed", "kg", "liquid that strands gave back to bulk liquid in this step"),
        ("film_height_max", "m", "largest height of a film"),
        ("film_speed_max", "m/s", "largest speed of a film along its strand"),
        ("film_wet_edges", "1", "edges with a film"),
        ("film_stuck_edges", "1", "edges whose film stands still under its yield stress"),
        ("film_substeps", "1", "sub-steps of film transport"),
    ] {
        columns.push(Column::new(name, unit, meaning));
    }
}

/// Values of those columns.
pub fn row(film: &FilmWorld, films: &Films, out: &mut Vec<f64>) {
    let reservoirs = reservoir_mass(film, films);
    let (ledger, report) = (&films.ledger, &film.report);
    out.push(film.liquid_mass(&films.state) - reservoirs);
    out.push(reservoirs);
    out.push(ledger.dripped + ledger.shed);
    out.extend([film.exchanged.dripped, film.exchanged.captured, film.exchanged.absorbed]);
    out.push(film.height.iter().copied().fold(0.0, f64::max));
    out.push(report.max_speed);
    out.extend([report.wet, report.stuck, report.substeps].map(|count| count as f64));
}

/// Mass waiting at the ends of strands [kg].
#[must_use]
pub fn reservoir_mass(film: &FilmWorld, films: &Films) -> f64 {
    let volumes = films.state.reservoir.iter().zip(&film.density).map(|([a, b], density)| density * (a + b));
    numerics::reduce::compensated_sum(volumes)
}

/// Figures for the summary.
pub fn summary(film: &FilmWorld, films: &Films, summary: &mut Map<String, Value>) {
    let ledger = &films.ledger;
    let reservoirs = reservoir_mass(film, films);
    summary.insert("film_mass".into(), json!(film.liquid_mass(&films.state) - reservoirs));
    summary.insert("reservoir_mass".into(), json!(reservoirs));
    summary.insert("dripped_mass".into(), json!(ledger.dripped + ledger.shed));
    summary.insert("captured_mass".into(), json!(ledger.captured));
    summary.insert("absorbed_mass".into(), json!(ledger.absorbed));
}
