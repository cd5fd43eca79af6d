//! Scripts as motions: of held vertices, solids and sources.
//!
//! As a rule a script becomes a motion with the same progress in time, without the steps of the original. Where scripts
//! overlap in a way that a list of motions cannot say, or where parity is wanted, the motion is replayed step by step and
//! written as key poses.

use super::Translation;
use super::fields::turn;
use crate::import::document::Sited;
use crate::import::notes::Heading;
use crate::import::original::fields::Usage;
use crate::import::original::scripts::{Kind, Progress, Script};
use crate::import::replay::{Body, MAX_STEPS, replay, unit_axis};
use crate::import::ron;
use crate::scene::error::ProblemKind;
use crate::scene::tree::{Node, Span, Value};
use nalgebra::{UnitQuaternion, Vector3};

/// More key poses than this are refused.
const MAX_KEYS: usize = 100_000;

impl Translation<'_, '_> {
    /// What the groups of the file are, where the original would trip over them.
    pub(super) fn check_groups(&self) {
        let count = self.original.group_count();
        let mut owners = std::collections::BTreeMap::new();
        for field in self.original.fields.iter().filter(|field| field.usage != Usage::Terminator) {
            if let Some(first) = owners.insert(field.group.value, field.span) {
                let what = format!("group {} has a second distancefield", field.group.value);
                let why = format!("the original stops here; the first is in line {}", self.document.line(first));
                self.document.note(Heading::Fault, field.span, what, why);
            }
        }
        for script in &self.original.scripts {
            let group = script.group.value;
            if group >= count {
                let why = "there is no such group; the original reads past its list here";
                self.document.note(Heading::Fault, script.group.span, format!("script of group {group}"), why);
            } else if !owners.contains_key(&group) && !self.group_is_held(group) {
                let why = "nothing in this group moves: no held vertex, solid or source";
                self.document.note(Heading::Ignored, script.span, format!("script of group {group}"), why);
            }
            if matches!(script.kind, Kind::Rotate | Kind::Swirl) {
                let length = Vector3::from(script.vector).norm();
                if unit_axis(script.vector).is_none() {
                    self.document.note(Heading::Fault, script.span, "turn about an axis without direction", "left out");
                } else if (length - 1.0).abs() > 1e-6 {
                    let what = format!("turn about an axis of length {length}");
                    let why = "taken as a direction; the original turns and distorts by it";
                    self.document.note(Heading::Fault, script.span, what, why);
                }
            }
        }
        for (index, script) in self.original.scripts.iter().enumerate() {
            let both = |other: &&Script| {
                other.group.value == script.group.value
                    && other.kind == script.kind
                    && script.kind != Kind::Switch
                    && overlap(other, script)
            };
            if !self.options.parity && self.original.scripts[..index].iter().any(|other| both(&other)) {
                let what = format!("two scripts move group {} at once", script.group.value);
                let why = "they add up here; the original carries held vertices by the last one only";
                self.document.note(Heading::Fault, script.span, what, why);
            }
        }
        if !self.options.parity && !self.original.scripts.is_empty() {
            let dt = self.original.run.step.value;
            let why = format!(
                "motions follow their own course in time; the original takes each speed one step ahead and is early by \
                 up to {} s (--parity replays it step by step)",
                1.5 * dt
            );
            self.document.note(Heading::Changed, Span::NONE, "scripts", why);
        }
    }

    fn group_is_held(&self, group: i64) -> bool {
        self.original.particles.iter().any(|particle| particle.group.value == group && particle.fixed & 3 != 0)
            || self.original.objects.iter().any(|object| object.group.value == group && !object.fixed.is_empty())
    }

    /// When a switch lets the held vertices of a group go; switches that do something else are noted.
    fn released(&self, group: i64) -> Option<Sited<f64>> {
        let mut switches: Vec<&Script> =
            self.original.scripts.iter().filter(|s| s.kind == Kind::Switch && s.group.value == group).collect();
        switches.sort_by(|a, b| a.during[0].total_cmp(&b.during[0]));
        let mut until = None;
        for switch in switches {
            let start = switch.during[0];
            if switch.mask & 1 != 0 && until.is_none() && start > 0.0 && start < self.original.run.end.value {
                until = Some(Sited { value: start, span: switch.span });
                if switch.mask & 2 == 0 && self.any_twist_held(group) {
                    let why = "twist goes with the places it is held at";
                    self.document.note(Heading::Changed, switch.span, "switch of places only", why);
                }
            } else if start >= self.original.run.end.value {
                self.document.note(Heading::Ignored, switch.span, "switch after the end", "it never acts");
            } else {
                let what = format!("switch with mask {} at {start} s", switch.mask);
                let why = "a clamp can let go once, place and twist together";
                self.document.note(Heading::NotHonoured, switch.span, what, why);
            }
        }
        until
    }

    fn any_twist_held(&self, group: i64) -> bool {
        self.original.particles.iter().any(|particle| particle.group.value == group && particle.twist_held())
    }

    /// Where a group is at the start: at its solid or source, else at the origin.
    fn place(&self, group: i64) -> Vector3<f64> {
        let of = |usage| self.original.fields.iter().find(|field| field.usage == usage && field.group.value == group);
        of(Usage::Solid)
            .or_else(|| of(Usage::Source))
            .map_or(Vector3::zeros(), |field| Vector3::from(field.center.value))
    }

    /// The motion of the held vertices of a group, by name, and when they are let go.
    pub(super) fn motion_of_vertices(&mut self, group: i64) -> (Option<Node>, Option<Sited<f64>>) {
        if let Some(known) = self.held_groups.get(&group) {
            return known.clone();
        }
        let motion = self.motion(group, Body::Vertices, &format!("group {group}"));
        let found = (motion, self.released(group));
        self.held_groups.insert(group, found.clone());
        found
    }

    /// The motion of a solid or source, by name.
    pub(super) fn motion_of_field(&mut self, index: usize) -> Option<Node> {
        let field = &self.original.fields[index];
        let group = field.group.value;
        let body = match field.usage {
            Usage::Solid => Body::Solid(turn(field)),
            Usage::Source => Body::Source(turn(field)),
            Usage::Terminator => return None,
        };
        self.motion(group, body, &format!("group {group}"))
    }

    fn motion(&mut self, group: i64, body: Body, name: &str) -> Option<Node> {
        let scripts: Vec<&Script> = self
            .original
            .scripts
            .iter()
            .filter(|script| script.group.value == group && script.kind != Kind::Switch)
            .filter(|script| {
                script.kind == Kind::Scale || script.kind == Kind::Translate || unit_axis(script.vector).is_some()
            })
            .filter(|script| script.during[0] < self.original.run.end.value)
            .collect();
        let scripts: Vec<&Script> = scripts.into_iter().filter(|script| self.scale_is_sound(script, body)).collect();
        if scripts.is_empty() {
            return None;
        }
        let smooth = if self.options.parity { None } else { self.smooth(&scripts, group, body) };
        let motions = match smooth {
            Some(motions) => motions,
            None => vec![self.replayed(&scripts, group, body)?],
        };
        let node = Node { span: scripts[0].span, value: Value::List(motions) };
        let taken = |motions: &[(String, Node)], name: &str| motions.iter().position(|(known, _)| known == name);
        let mut name = name.to_owned();
        while let Some(place) = taken(&self.motions, &name) {
            if self.motions[place].1 == node {
                return Some(ron::text(&name));
            }
            name.push_str(if body == Body::Vertices { " vertices" } else { " body" });
        }
        self.motions.push((name.clone(), node));
        Some(ron::text(&name))
    }

    fn scale_is_sound(&self, script: &Script, body: Body) -> bool {
        if script.kind != Kind::Scale {
            return true;
        }
        let [x, y, z] = script.vector;
        let refuse = |why: &str| {
            let what = format!("scale by {x} {y} {z}");
            self.document.note(Heading::NotHonoured, script.span, what, why);
            false
        };
        if x <= 0.0 || y <= 0.0 || z <= 0.0 {
            return refuse("factors must be above 0");
        }
        if x != y || y != z {
            return refuse("shapes and clamps scale by one factor for all directions");
        }
        if script.progress != Progress::Cubic {
            return refuse("the original scales with func `cubic` only");
        }
        if body != Body::Vertices {
            let why = "to the size that is written; the original multiplies the size anew in every step";
            self.document.note(Heading::Fault, script.span, "scale of a solid or source", why);
        }
        true
    }

    /// Key poses step by step.
    fn replayed(&self, scripts: &[&Script], group: i64, body: Body) -> Option<Node> {
        let run = &self.original.run;
        let (dt, end) = (run.step.value, run.end.value);
        if !(end / dt <= MAX_STEPS) {
            let message = format!("{:.1e} steps of {dt} s are too many to follow its scripts step by step", end / dt);
            self.document.problem(
                ProblemKind::TooLarge,
                run.step.span,
                message,
                "make `dt` larger or `duration` shorter",
            );
            return None;
        }
        let keys = replay(scripts, self.place(group), body, dt, end);
        if keys.len() > MAX_KEYS {
            let message = format!("the scripts of group {group} need {} key poses", keys.len());
            let help = format!("at most {MAX_KEYS} are written: make `dt` larger");
            self.document.problem(ProblemKind::TooLarge, scripts[0].span, message, help);
            return None;
        }
        if keys.is_empty() {
            return None;
        }
        let pose = |key: &crate::import::replay::Key| {
            let mut fields = vec![("time", ron::plain(key.time))];
            if key.translation != Vector3::zeros() {
                fields.push(("translate", ron::plain_vector(key.translation.into())));
            }
            if key.rotation != Vector3::zeros() {
                fields.push(("rotate", ron::plain_vector(key.rotation.map(f64::to_degrees).into())));
            }
            if key.scale != Vector3::repeat(1.0) {
                fields.push(("scale", ron::plain(key.scale.x)));
            }
            ron::group(Span::NONE, "", fields)
        };
        let fields = vec![
            ("poses", ron::list(keys.iter().map(pose).collect())),
            ("center", ron::plain_vector(self.place(group).into())),
            ("ease", ron::name("Linear")),
        ];
        Some(ron::group(scripts[0].span, "Keyframes", fields))
    }

    /// The scripts as motions without steps; `None` where a list of motions cannot say it.
    ///
    /// The pose of a group is a turn about its own place followed by a displacement. So all turns about the place stand
    /// before all displacements and may overlap them. Turns about other points also displace: with them the order of the
    /// list is the order in time, and nothing may overlap.
    fn smooth(&self, scripts: &[&Script], group: i64, body: Body) -> Option<Vec<Node>> {
        let mut scripts: Vec<&Script> = scripts.to_vec();
        scripts.sort_by(|a, b| a.during[0].total_cmp(&b.during[0]));
        let ramped = |script: &&Script| {
            let [rise, fall] = script.ramps;
            let time = script.during[1] - script.during[0];
            script.progress == Progress::Cubic && rise >= 0.0 && fall >= 0.0 && rise + fall <= time * (1.0 + 1e-12)
        };
        if !scripts.iter().all(ramped) {
            return None;
        }
        let displaces = |script: &Script| script.origin.is_some() || (script.kind == Kind::Scale && script.global);
        let turns = |script: &Script| matches!(script.kind, Kind::Rotate | Kind::Swirl);
        let clash = |a: &Script, b: &Script| {
            let simple = |s: &Script| !displaces(s);
            let apart =
                simple(a) && simple(b) && !(turns(a) && turns(b) && (a.vector != b.vector || a.global != b.global));
            overlap(a, b) && !apart
        };
        for (i, script) in scripts.iter().enumerate() {
            if scripts[..i].iter().any(|other| clash(other, script)) {
                return None;
            }
        }
        let first = match body {
            Body::Vertices => UnitQuaternion::identity(),
            Body::Solid(turn) | Body::Source(turn) => turn,
        };
        let place = self.place(group);
        if scripts.iter().any(|script| displaces(script)) {
            return Some(in_order(&scripts, place, body, first));
        }
        let (mut inner, mut outer) = (Vec::new(), Vec::new());
        for script in scripts {
            match script.kind {
                Kind::Translate => outer.push(translate(script)),
                Kind::Scale => inner.push(scale(script, place)),
                Kind::Rotate | Kind::Swirl | Kind::Switch => {
                    let local = !script.global && !matches!(body, Body::Source(_));
                    let axis = Vector3::from(script.vector);
                    if local {
                        inner.insert(0, rotate(script, first * axis, Some(place), 1.0));
                    } else {
                        inner.push(rotate(script, axis, Some(place), 1.0));
                    }
                }
            }
        }
        inner.extend(outer);
        Some(inner)
    }
}

/// Motions one after the other, each about where the ones before have brought the group.
fn in_order(scripts: &[&Script], place: Vector3<f64>, body: Body, first: UnitQuaternion<f64>) -> Vec<Node> {
    let mut motions = Vec::new();
    let (mut position, mut rotation) = (place, UnitQuaternion::identity());
    for script in scripts {
        match script.kind {
            Kind::Translate => {
                motions.push(translate(script));
                position += Vector3::from(script.vector);
            }
            Kind::Scale => {
                let about = if script.global { Vector3::zeros() } else { position };
                motions.push(scale(script, about));
                if script.global {
                    position *= script.vector[0];
                }
            }
            Kind::Rotate | Kind::Swirl | Kind::Switch => {
                let local = script.kind == Kind::Rotate && !script.global && !matches!(body, Body::Source(_));
                let own = Vector3::from(script.vector);
                let axis = if local { rotation * (first * own) } else { own };
                let about = script.origin.map_or(position, Vector3::from);
                motions.push(rotate(script, axis, Some(about), 1.0));
                if script.kind == Kind::Swirl && body != Body::Vertices {
                    // carried round, but not turned
                    motions.push(rotate(script, axis, None, -1.0));
                } else if let Some(unit) = unit_axis(axis.into()) {
                    rotation = UnitQuaternion::from_axis_angle(&unit, script.angle) * rotation;
                }
                if let Some(unit) = unit_axis(axis.into()) {
                    position = about + UnitQuaternion::from_axis_angle(&unit, script.angle) * (position - about);
                }
            }
        }
    }
    motions
}

fn overlap(a: &Script, b: &Script) -> bool {
    a.during[0] < b.during[1] - 1e-12 && b.during[0] < a.during[1] - 1e-12
}

/// When and with which progress.
fn timing(script: &Script) -> [(&'static str, Node); 2] {
    let sited = |value| Sited { value, span: script.span };
    let [start, end] = script.during;
    let share = |ramp: f64| ramp / (end - start);
    let mut fields = Vec::new();
    for (name, ramp) in [("rise", share(script.ramps[0])), ("fall", share(script.ramps[1]))] {
        if (ramp - 1.0 / 3.0).abs() > 1e-12 {
            fields.push((name, ron::plain(ramp)));
        }
    }
    [("during", ron::interval(sited(start), sited(end))), ("ease", ron::group(Span::NONE, "Ramps", fields))]
}

fn translate(script: &Script) -> Node {
    let mut fields = vec![("by", ron::vector(Sited { value: script.vector, span: script.span }))];
    fields.extend(timing(script));
    ron::group(script.span, "Translate", fields)
}

fn rotate(script: &Script, axis: Vector3<f64>, about: Option<Vector3<f64>>, sense: f64) -> Node {
    let angle = Sited { value: sense * script.angle.to_degrees(), span: script.span };
    let mut fields = vec![("angle", ron::number(angle)), ("axis", ron::axis(axis.into()))];
    fields.extend(about.map(|about| ("center", ron::plain_vector(about.into()))));
    fields.extend(timing(script));
    ron::group(script.span, "Rotate", fields)
}

fn scale(script: &Script, about: Vector3<f64>) -> Node {
    let factor = Sited { value: script.vector[0], span: script.span };
    let mut fields = vec![("factor", ron::number(factor)), ("center", ron::plain_vector(about.into()))];
    fields.extend(timing(script));
    ron::group(script.span, "Scale", fields)
}
