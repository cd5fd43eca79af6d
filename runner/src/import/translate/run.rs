//! Time, air, contact, and what is switched off.

use super::Translation;
use crate::import::notes::Heading;
use crate::import::ron;
use crate::scene::tree::{Node, Span};

impl Translation<'_, '_> {
    /// The time span: the step of the file, or as long as the liquid allows where there is liquid only.
    pub(super) fn time(&self) -> Node {
        let run = &self.original.run;
        let liquid_only = self.is_wet() && self.has_sources() && self.original.hairs.is_empty();
        let step = if liquid_only && self.original.objects.is_empty() {
            let mut fields = vec![("max", ron::number(run.step))];
            if run.cfl.value != 1.0 {
                fields.push(("cfl", ron::number(run.cfl)));
            }
            ron::group(run.step.span, "Adaptive", fields)
        } else {
            if self.is_wet() && self.has_sources() {
                let why = "a step that liquid crosses too fast is halved; the original cuts it beforehand";
                self.document.note(
                    Heading::Changed,
                    run.step.span,
                    format!("integrator: dt = {}", run.step.value),
                    why,
                );
            }
            ron::wrap("Fixed", ron::number(run.step))
        };
        let parts = self.original.switches.parts;
        if parts.value != 1.0 {
            let what = format!("SimulationParameters/subSteps = {}", parts.value);
            self.document.note(Heading::NotHonoured, parts.span, what, "steps are those of the integrator");
        }
        ron::group(run.end.span, "", vec![("end", ron::number(run.end)), ("step", step)])
    }

    /// Drag of still air.
    pub(super) fn air_drag(&self) -> Option<Node> {
        let drag = self.original.switches.air_drag;
        let strands = !self.original.hairs.is_empty() || !self.original.objects.is_empty();
        (drag.value != 0.0 && strands).then(|| ron::number(drag))
    }

    /// What may touch what.
    pub(super) fn contact(&self) -> Option<Node> {
        let switches = &self.original.switches;
        let mut fields = Vec::new();
        if switches.skip_strand_strand.value {
            fields.push(("strand_strand", ron::flag(false)));
        }
        if switches.skip_strand_solid.value {
            fields.push(("strand_solid", ron::flag(false)));
        }
        if let Some(most) = switches.contacts_per_edge
            && most.value != 6
        {
            let node = ron::number(most.map(|count| f64::from(i32::try_from(count).unwrap_or(i32::MAX))));
            fields.push(("detection", ron::group(most.span, "", vec![("max_per_edge", node)])));
        }
        let strands = self.original.hairs.len() + self.original.objects.len();
        if strands == 1 && self.original.objects.is_empty() && fields.is_empty() {
            let why = "contact of a strand with itself is not looked for unless `contact` says more";
            self.document.note(Heading::Changed, Span::NONE, "a lone strand", why);
        }
        (!fields.is_empty() && strands > 0).then(|| ron::group(Span::NONE, "", fields))
    }

    /// Components that the file switches off.
    pub(super) fn disable(&self) -> Option<Node> {
        let liquid = &self.original.liquid;
        let mut off = Vec::new();
        if self.is_wet() {
            let strands = !self.original.hairs.is_empty() || !self.original.objects.is_empty();
            for (flag, name) in
                [(liquid.capture, "Capture"), (liquid.drag, "Drag"), (liquid.volume_fraction, "VolumeFraction")]
            {
                if strands && !flag.value {
                    off.push(name);
                }
            }
            if !liquid.shear.value {
                off.push("Shear");
            }
            if let Some(step) = liquid.correction_step {
                if step.value == 0 {
                    off.push("Resampling");
                    let why = "particles are not split and merged either";
                    self.document.note(Heading::Changed, step.span, "liquidinfo/correctionStep = 0", why);
                } else if step.value != 1 {
                    let what = format!("liquidinfo/correctionStep = {}", step.value);
                    self.document.note(Heading::Changed, step.span, what, "particles are relaxed in every step");
                }
            }
        } else if self.has_films() {
            off.extend(["FilmAdvection", "FilmShear", "FilmPlasticFlow", "Dripping"]);
        }
        (!off.is_empty()).then(|| ron::list(off.into_iter().map(ron::name).collect()))
    }
}
