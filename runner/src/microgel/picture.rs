//! What a sample looks like: grains with their stress, contacts, links, and the box.

use super::settings::MICROMETRES;
use crate::record::frame::{Field, FieldValues, Frame, Piece, Topology};
use granular::assembly::ContactView;
use granular::experiment::Rheometer;
use granular::frame::{Frame as Snapshot, frame as snapshot};
use granular::model::ContactKind;

/// Newtons per metre (newtons, for spheres) in one unit of force of the library, µm mg s⁻².
const FORCE: f64 = 1e-12;

/// The visible state of one sample.
///
/// Grains carry `radius` [m], `id`, `particle`, `plate`, `velocity` [m/s], `stress` [Pa] (row by row, compression positive),
/// `pressure` [Pa] and `coordination`. Contacts and links carry `state` (1 stick, 2 slip, 3 link), `force` and
/// `tangential_force` [N/m; spheres N], `chain` (1 in a force chain). A contact that reaches across an edge of the box is drawn
/// as two halves, one at each of its grains.
pub(super) fn frame(rheometer: &Rheometer, step: u64, time: f64) -> Frame {
    let view = snapshot(rheometer.assembly());
    let positions = positions(&view);
    let links = |contact: &ContactView| contact.kind == ContactKind::Permanent;
    let pieces = vec![
        grains(&view, positions.clone()),
        lines("contacts", &view, &positions, |contact| !links(contact)),
        lines("links", &view, &positions, links),
        outline(&view),
    ];
    Frame { time, step, pieces }
}

fn positions(view: &Snapshot) -> Vec<[f64; 3]> {
    (0..view.grains.len())
        .map(|i| {
            let z = view.z.get(i).copied().unwrap_or(0.0);
            [view.grains.x[i] / MICROMETRES, view.grains.y[i] / MICROMETRES, z / MICROMETRES]
        })
        .collect()
}

fn grains(view: &Snapshot, positions: Vec<[f64; 3]>) -> Piece {
    let n = view.grains.len();
    let velocity: Vec<[f64; 3]> =
        (0..n).map(|i| [view.grains.vx[i] / MICROMETRES, view.grains.vy[i] / MICROMETRES, 0.0]).collect();
    let stress: Vec<f64> =
        view.stress.iter().flat_map(|s| [s.0[0], s.0[1], 0.0, s.0[2], s.0[3], 0.0, 0.0, 0.0, 0.0]).collect();
    let whole = |values: &mut dyn Iterator<Item = i64>, name: &str| Field::integer(name, values.collect());
    Piece {
        name: "grains".to_owned(),
        topology: Topology::Points,
        positions,
        point_fields: vec![
            whole(&mut (0..n as i64), "id"),
            whole(&mut view.particle.iter().map(|p| i64::from(*p)), "particle"),
            whole(&mut view.plate.iter().map(|p| i64::from(*p)), "plate"),
            Field::scalar("radius", view.grains.radius.iter().map(|r| r / MICROMETRES).collect()),
            Field::vector("velocity", &velocity),
            Field::scalar("spin", view.grains.omega.clone()),
            Field { name: "stress".to_owned(), components: 9, values: FieldValues::F64(stress) },
            Field::scalar("pressure", view.stress.iter().map(|s| s.pressure()).collect()),
            whole(&mut view.coordination.iter().map(|c| i64::from(*c)), "coordination"),
        ],
        cell_fields: Vec::new(),
    }
}

fn lines(name: &str, view: &Snapshot, grains: &[[f64; 3]], wanted: impl Fn(&ContactView) -> bool) -> Piece {
    let (mut positions, mut pairs) = (Vec::new(), Vec::new());
    let (mut state, mut force, mut tangential, mut chain) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut add = |from: [f64; 3], to: [f64; 3], contact: &ContactView, in_chain: bool| {
        let first = positions.len() as u32;
        positions.extend([from, to]);
        pairs.push([first, first + 1]);
        state.push(contact.kind as i64);
        force.push(contact.normal_force * FORCE);
        tangential.push(contact.tangential_force * FORCE);
        chain.push(i64::from(in_chain));
    };
    for (contact, in_chain) in view.contacts.iter().zip(&view.in_chain).filter(|(contact, _)| wanted(contact)) {
        let (a, b) = (grains[contact.i as usize], grains[contact.j as usize]);
        let apart = contact.separation.map(|s| s / MICROMETRES);
        // grains may have wrapped since the contact was last found
        let same = (0..2).all(|k| (b[k] - a[k] - apart[k]).abs() < 0.25 * view.height.min(view.width) / MICROMETRES);
        if same {
            add(a, b, contact, *in_chain);
        } else {
            let half = apart.map(|s| 0.5 * s);
            add(a, [a[0] + half[0], a[1] + half[1], a[2]], contact, *in_chain);
            add(b, [b[0] - half[0], b[1] - half[1], b[2]], contact, *in_chain);
        }
    }
    Piece {
        name: name.to_owned(),
        topology: Topology::Segments(pairs),
        positions,
        point_fields: Vec::new(),
        cell_fields: vec![
            Field::integer("state", state),
            Field::scalar("force", force),
            Field::scalar("tangential_force", tangential),
            Field::integer("chain", chain),
        ],
    }
}

/// The box, with its strain and shear rate.
fn outline(view: &Snapshot) -> Piece {
    let (width, height) = (view.width / MICROMETRES, view.height / MICROMETRES);
    Piece {
        name: "box".to_owned(),
        topology: Topology::Polylines { offsets: vec![0, 5] },
        positions: vec![[0.0; 3], [width, 0.0, 0.0], [width, height, 0.0], [0.0, height, 0.0], [0.0; 3]],
        point_fields: Vec::new(),
        cell_fields: vec![Field::scalar("strain", vec![view.strain]), Field::scalar("shear_rate", vec![view.rate])],
    }
}
