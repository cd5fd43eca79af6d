//! What contact writes: columns of the series, the summary, points for viewing.

use ::contact::detection::Contact;
use ::contact::law::ContactState;
use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use super::ContactWorld;
use super::memory::ContactMemory;
use crate::record::frame::{Field, Piece, Topology};
use crate::system::Column;
use crate::world::solids::SceneSolid;

/// Columns of contact.
pub fn columns(contact: &ContactWorld, solids: &[SceneSolid], columns: &mut Vec<Column>) {
    for (name, unit, meaning) in [
        (
            "contacts",
            "1",
            "contacts that motion or impulses would close in the step, and bridges of liquid that do not merely pull",
        ),
        ("open", "1", "contacts without impulse"),
        ("sticking", "1", "contacts that stick"),
        ("slipping", "1", "contacts that slide"),
        ("cohesive", "1", "contacts held by cohesion"),
        ("contact_rounds", "1", "contact problems solved in the step"),
        ("contact_iterations", "1", "iterations of all contact solvers"),
        ("contact_residual", "1", "natural-map residual of the contact law, relative"),
        ("contact_warnings", "1", "steps so far whose contact problem missed its tolerance"),
        ("worst_penetration", "m", "deepest overlap at the start of the step"),
    ] {
        columns.push(Column::new(name, unit, meaning));
    }
    if contact.cohesion.is_some() {
        columns.push(Column::new("bridges", "1", "contacts joined by a bridge of liquid"));
    }
    if contact.cross_check.is_some() {
        let meaning = "largest velocity difference to the second solver when last asked, relative to the free velocity";
        columns.push(Column::new("cross_check_difference", "1", meaning));
    }
    if contact.with_solids {
        for (index, solid) in solids.iter().enumerate() {
            let name = column_name(&solid.name, index);
            for axis in ["x", "y", "z"] {
                columns.push(Column::new(format!("{name}_force_{axis}"), "N", "force of the strands on the solid"));
            }
            for axis in ["x", "y", "z"] {
                let meaning = "torque of the strands on the solid about its centre";
                columns.push(Column::new(format!("{name}_torque_{axis}"), "N m", meaning));
            }
        }
    }
}

/// Name of a solid as part of a column: `solid0` and so on where the scene gives none.
fn column_name(name: &str, index: usize) -> String {
    if name == format!("solid {index}") {
        return format!("solid{index}");
    }
    name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect()
}

/// Values of those columns.
pub fn row(contact: &ContactWorld, memory: &ContactMemory, out: &mut Vec<f64>) {
    let r = &contact.report;
    for count in [r.contacts, r.open, r.sticking, r.slipping, r.cohesive, r.rounds, r.iterations] {
        out.push(count as f64);
    }
    out.extend([r.residual, memory.warnings as f64, r.worst_penetration]);
    if contact.cohesion.is_some() {
        out.push(r.bridges as f64);
    }
    if contact.cross_check.is_some() {
        out.push(memory.confirmation.last);
    }
    if contact.with_solids {
        for on_solid in &contact.on_solids {
            out.extend(on_solid.force.iter().chain(on_solid.torque.iter()));
        }
    }
}

/// Figures for the summary.
pub fn summary(contact: &ContactWorld, memory: &ContactMemory, summary: &mut Map<String, Value>) {
    summary.insert("contact_warnings".into(), json!(memory.warnings));
    if contact.cross_check.is_some() {
        let told = &memory.confirmation;
        summary.insert(
            "cross_check".into(),
            json!({ "problems": told.asked, "undecided": told.undecided, "worst_difference": told.worst }),
        );
    }
}

/// The contacts of the last step as points between the surfaces.
#[must_use]
pub fn picture(contact: &ContactWorld) -> Piece {
    let lists = &contact.lists;
    let loose = std::iter::repeat(&ContactState::Open);
    let shown = lists.acting().zip(lists.states.iter().chain(loose));
    let mut piece = Piece {
        name: "contacts".to_owned(),
        topology: Topology::Points,
        positions: Vec::new(),
        point_fields: Vec::new(),
        cell_fields: Vec::new(),
    };
    let (mut normal, mut impulse, mut size) = (Vec::new(), Vec::new(), Vec::new());
    let (mut state, mut strand, mut other) = (Vec::new(), Vec::new(), Vec::new());
    for ((c, r), s) in shown {
        piece.positions.push(contact.point(c).into());
        normal.push(c.normal);
        let world = world_impulse(c, &r);
        impulse.push(world.into());
        size.push(world.norm());
        state.push(code(*s));
        strand.push(i64::from(c.key.a.0));
        // solids count −1, −2, …
        other.push(if c.with_solid() { -1 - i64::from(c.key.b.1) } else { i64::from(c.key.b.0) });
    }
    piece.point_fields = vec![
        Field::integer("strand", strand),
        Field::integer("other", other),
        Field::integer("state", state),
        Field::vector("normal", &normal),
        Field::vector("impulse", &impulse),
        Field::scalar("impulse_size", size),
    ];
    piece
}

/// States in files: 0 open, 1 stick, 2 slip, 3 cohesive.
fn code(state: ContactState) -> i64 {
    match state {
        ContactState::Open => 0,
        ContactState::Stick => 1,
        ContactState::Slip => 2,
        ContactState::Cohesive => 3,
    }
}

/// Impulse on side A in the world's axes [N s].
#[must_use]
pub fn world_impulse(contact: &Contact, impulse: &[f64; 3]) -> Vector3<f64> {
    let basis = contact.posed(0.0, 0.0, 4).basis();
    Vector3::from(basis[0]) * impulse[0] + Vector3::from(basis[1]) * impulse[1] + Vector3::from(basis[2]) * impulse[2]
}

impl ContactWorld {
    /// Where the surface of side A is touched at the end of the step [m].
    #[must_use]
    pub fn point(&self, contact: &Contact) -> Vector3<f64> {
        let v = self.first_vertex[contact.key.a.0 as usize] as usize + contact.key.a.1 as usize;
        let (p, q) = (Vector3::from(self.lists.end[v]), Vector3::from(self.lists.end[v + 1]));
        p + (q - p) * contact.alpha - Vector3::from(contact.normal) * self.edge_radius[v]
    }
}
