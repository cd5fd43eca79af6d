//! Liquids as materials, the bulk liquid, and how films are computed.

use super::Translation;
use crate::import::notes::Heading;
use crate::import::original::fields::{DistanceField, Shape, Usage};
use crate::import::original::liquid::Component;
use crate::import::ron;
use crate::scene::tree::{Node, Span};
use std::collections::BTreeSet;

impl Translation<'_, '_> {
    /// The name of the liquid of a colour index.
    pub(super) fn liquid_name(&self, colour: i64) -> String {
        if self.original.liquid.components.len() == 1 { "liquid".to_owned() } else { format!("liquid {colour}") }
    }

    /// Materials: a fibre per parameter set that strands use, a liquid per colour that flows.
    pub(super) fn materials(&self) -> Option<Node> {
        let mut entries = self.fibres();
        if self.is_wet() || self.films_wanted() {
            let sources = self.original.fields.iter().filter(|field| field.usage == Usage::Source);
            let mut colours: BTreeSet<i64> = sources.map(|field| field.colour.value).collect();
            if self.films_wanted() {
                colours.insert(0);
            }
            for colour in colours {
                let index = usize::try_from(colour).unwrap_or(0);
                entries.push((self.liquid_name(colour), self.liquid_material(self.original.liquid.component(index))));
            }
        }
        (!entries.is_empty()).then(|| ron::map(entries))
    }

    fn liquid_material(&self, liquid: &Component) -> Node {
        let info = &self.original.liquid;
        let flow = vec![
            ("yield_stress", ron::number(liquid.yield_stress)),
            ("consistency", ron::number(liquid.consistency)),
            ("index", ron::number(liquid.index)),
        ];
        let fields = vec![
            ("density", ron::number(liquid.density)),
            ("bulk_modulus", ron::number(liquid.bulk_modulus)),
            ("shear_modulus", ron::number(liquid.shear_modulus)),
            ("flow", ron::group(liquid.yield_stress.span, "J2", flow)),
            ("surface_tension", ron::number(liquid.surface_tension)),
            ("contact_angle", ron::number(info.contact_angle)),
            ("tearing_strain", ron::number(liquid.tearing_strain)),
            ("recovery_time", ron::number(liquid.recovery_time)),
            ("film_height", ron::number(info.film_height)),
            ("shear_damping", ron::number(info.shear_damping)),
        ];
        ron::group(liquid.density.span, "Liquid", fields)
    }

    /// The bulk liquid; also where only films are, for what drips from them.
    pub(super) fn liquid(&mut self) -> Option<Node> {
        if !self.original.switches.solve_liquids.value {
            for field in self.original.fields.iter().filter(|field| field.usage == Usage::Source) {
                let why = "solveLiquids = 0: it never emits";
                self.document.note(Heading::Ignored, field.span, "source", why);
            }
            if self.has_films() {
                let span = self.original.switches.solve_liquids.span;
                let why = "films weigh on the strands and do not flow: their components are switched off";
                self.document.note(Heading::Changed, span, "SimulationParameters/solveLiquids = 0", why);
            }
            return None;
        }
        if !self.is_wet() {
            return None;
        }
        let info = &self.original.liquid;
        let run = &self.original.run;
        let mut fields = vec![("cell", ron::number(run.cell)), ("particles_per_cell", self.particles_per_cell())];
        fields.extend(self.domain().map(|domain| ("domain", domain)));
        let (tanks, sources) = self.sources();
        let drains = self.drains();
        for (name, list) in [("tanks", tanks), ("sources", sources), ("drains", drains)] {
            if !list.is_empty() {
                fields.push((name, ron::list(list)));
            }
        }
        if self.options.parity {
            fields.push(("flow_map", ron::name("Split")));
        }
        let iterations = info.iterations.filter(|iterations| iterations.value != 1000);
        for (name, tolerance, usual) in
            [("shear", info.shear_tolerance, 1e-6), ("pressure", info.pressure_tolerance, 1e-8)]
        {
            let mut solver = Vec::new();
            if tolerance.value != usual {
                solver.push(("tolerance", ron::number(tolerance)));
            }
            if let Some(iterations) = iterations {
                #[allow(clippy::cast_precision_loss)]
                solver.push(("max_iterations", ron::number(iterations.map(|count| count as f64))));
            }
            if !solver.is_empty() {
                fields.push((name, ron::group(tolerance.span, "", solver)));
            }
        }
        self.damping(&mut fields);
        Some(ron::group(run.cell.span, "", fields))
    }

    fn damping(&self, fields: &mut Vec<(&str, Node)>) {
        let info = &self.original.liquid;
        let why = "a fraction lost in every step: its effect depends on the step";
        let [stretch, turn] = info.affine_damping;
        let value = |number: Option<crate::import::document::Number>| number.map_or(0.0, |number| number.value);
        if let Some(damping) = turn.or(stretch).filter(|_| value(turn) != 0.0 || value(stretch) != 0.0) {
            if value(turn) != value(stretch) {
                let what = format!("affineStretchDamping = {}, affineRotateDamping = {}", value(stretch), value(turn));
                let why = "one number damps both here: that of the rotation";
                self.document.note(Heading::Changed, damping.span, what, why);
            }
            if damping.value != 0.0 {
                fields.push(("affine_damping", ron::number(damping)));
                let what = format!("affine damping = {}", damping.value);
                self.document.note(Heading::Changed, damping.span, what, why);
            }
        }
        if let Some(damping) = info.velocity_damping.filter(|damping| damping.value != 0.0) {
            fields.push(("velocity_damping", ron::number(damping)));
            let what = format!("liquidinfo/velocityDamping = {}", damping.value);
            self.document.note(Heading::Changed, damping.span, what, why);
        }
    }

    fn particles_per_cell(&self) -> Node {
        let spacing = self.original.liquid.particle_spacing;
        let along = (1.0 / spacing.value).round().clamp(1.0, 16.0);
        let exact = along * spacing.value;
        if !(0.999..1.001).contains(&exact) {
            let what = format!("particleCellMultiplier = {}", spacing.value);
            let why = format!("{along:.0} particles along each side of a cell");
            self.document.note(Heading::Changed, spacing.span, what, why);
        }
        let mut node = ron::plain(along.powi(3));
        node.span = spacing.span;
        node
    }

    /// An upright box outside which liquid disappears.
    fn domain(&self) -> Option<Node> {
        let mut low = [f64::NEG_INFINITY; 3];
        let mut high = [f64::INFINITY; 3];
        let mut span = Span::NONE;
        for field in self.original.fields.iter().filter(|field| is_outer_box(field)) {
            let Shape::Box { half, rounding } = &field.shape else { continue };
            span = field.span;
            for i in 0..3 {
                let reach = half.value[i] + rounding;
                low[i] = low[i].max(field.center.value[i] - reach);
                high[i] = high[i].min(field.center.value[i] + reach);
            }
        }
        (span != Span::NONE)
            .then(|| ron::group(span, "", vec![("low", ron::plain_vector(low)), ("high", ron::plain_vector(high))]))
    }

    fn drains(&mut self) -> Vec<Node> {
        let mut drains = Vec::new();
        for field in self.original.fields.iter().filter(|field| field.usage == Usage::Terminator) {
            if is_outer_box(field) {
                continue;
            }
            if field.inverted.value {
                let why = "liquid can disappear inside any shape, but outside only of an upright box";
                self.document.note(Heading::NotHonoured, field.span, "inverted terminator", why);
                continue;
            }
            if let Some(shape) = self.volume(field) {
                drains.push(ron::group(field.span, "", vec![("shape", shape)]));
            }
        }
        drains
    }

    /// Liquid at the start, and sources.
    fn sources(&mut self) -> (Vec<Node>, Vec<Node>) {
        let (mut tanks, mut sources) = (Vec::new(), Vec::new());
        let end = self.original.run.end.value;
        for (index, field) in self.original.fields.iter().enumerate() {
            if field.usage != Usage::Source {
                continue;
            }
            if field.inverted.value {
                let why = "a source fills the inside of its shape";
                self.document.note(Heading::NotHonoured, field.inverted.span, "source: inverted = 1", why);
                continue;
            }
            let Some(shape) = self.volume(field) else { continue };
            let material = self.liquid_name(field.colour.value);
            if usize::try_from(field.colour.value).is_ok_and(|c| c >= self.original.liquid.components.len()) {
                let message = format!("there is no liquid {}", field.colour.value);
                let kind = crate::scene::error::ProblemKind::UnknownReference;
                self.document.problem(kind, field.colour.span, message, "set numComponents in liquidinfo");
            }
            if field.emissions.is_empty() {
                let mut tank = vec![("material", ron::text(&material)), ("shape", shape)];
                if field.fill_velocity.value != [0.0; 3] {
                    tank.push(("velocity", ron::vector(field.fill_velocity)));
                }
                tanks.push(ron::group(field.span, "", tank));
                let why = "it fills its shape once, at the start: a tank";
                self.document.note(Heading::Changed, field.span, "source without emit", why);
                continue;
            }
            let motion = self.motion_of_field(index);
            for emission in &field.emissions {
                let [start, stop] = emission.during;
                if stop.value <= start.value || start.value >= end {
                    self.document.note(Heading::Ignored, emission.span, "emit outside the run", "it never emits");
                    continue;
                }
                let mut source = vec![
                    ("material", ron::text(&material)),
                    ("shape", shape.clone()),
                    ("velocity", ron::vector(emission.velocity)),
                    ("during", ron::interval(start, stop)),
                ];
                source.extend(motion.clone().map(|motion| ("motion", motion)));
                sources.push(ron::group(emission.span, "", source));
            }
        }
        if !sources.is_empty() {
            let what = "sources";
            let why = "the original fills any sub-cell that is empty at random, about 1.6 times what flows through; \
                       here a source gives what its shape and velocity say, and holds the liquid in it at that velocity";
            self.document.note(Heading::Changed, Span::NONE, what, why);
        }
        (tanks, sources)
    }

    /// How films are computed, where it is not as usual.
    pub(super) fn film_model(&self) -> Option<Node> {
        (self.options.parity && self.films_wanted()).then(|| {
            let fields = vec![("wall", ron::name("Paper")), ("advection", ron::name("SemiLagrangian"))];
            ron::group(Span::NONE, "", fields)
        })
    }
}

fn is_outer_box(field: &DistanceField) -> bool {
    field.usage == Usage::Terminator
        && field.inverted.value
        && field.angle == 0.0
        && matches!(field.shape, Shape::Box { .. })
}
