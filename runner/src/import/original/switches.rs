//! `SimulationParameters` and `CollisionParameters`.

use super::{Element, Number, Sited, flag_or, list, number_or, only_if};
use crate::import::notes::Heading;

/// What of them becomes part of the scene.
pub struct Switches {
    /// Drag of air on strands [g/(cm s)].
    pub air_drag: Number,
    /// Friction between strands.
    pub strand_friction: Number,
    /// Friction of strands with solids.
    pub solid_friction: Number,
    /// No contact between strands.
    pub skip_strand_strand: Sited<bool>,
    /// No contact with solids.
    pub skip_strand_solid: Sited<bool>,
    /// Liquid and films are computed.
    pub solve_liquids: Sited<bool>,
    /// Parts of a step.
    pub parts: Number,
    /// Most contacts per edge.
    pub contacts_per_edge: Option<Sited<i64>>,
    /// Distance at which strands touch each other, per strand [cm].
    pub strand_contact_radius: Number,
    /// Distance at which strands touch solids [cm].
    pub solid_contact_radius: Number,
}

const MACHINERY: &[(&str, &str)] = &[
    ("statGathering", "every run keeps its record"),
    ("numberOfThreads", "threads are chosen when running; results do not depend on them"),
    ("logLevel", "the record has it all"),
    ("simulationManagerLimitedMemory", "no counterpart needed"),
    ("useExactJacobian", "`solver.rods.hessian` chooses; the default takes what is safe"),
    ("useProjectedJacobian", "`solver.rods.hessian` chooses; the default takes what is safe"),
    ("maxNewtonIterations", "a step that does not converge is halved instead; see `solver.rods`"),
    ("gaussSeidelIterations", "the contact solver stops by its residual; see `contact`"),
    ("gaussSeidelTolerance", "another measure of error; see `contact.tolerance`"),
    ("bogusAlgorithm", "the contact solver chooses by measured progress; see `contact.solver`"),
    ("pruneSelfCollisions", "nothing is pruned at random"),
    ("pruneExternalCollisions", "nothing is pruned at random"),
    ("stochasticPruning", "nothing is pruned at random"),
    ("useDeterministicSolver", "all runs are deterministic"),
    ("percentCTRodRodCollisionsAccept", "contacts are found along the whole motion of a step"),
    ("useCTRodRodCollisions", "contacts are found along the whole motion of a step"),
    ("useAdditionalExternalFailSafe", "steps that fail are halved"),
    ("usePreFilterGeometry", "no geometry is filtered"),
    ("useApproxRodElasticFriction", "friction acts in full"),
];

impl Switches {
    /// Reads them; both sections may be absent.
    #[must_use]
    pub fn read(root: &Element<'_, '_>) -> Switches {
        let document = root.document();
        let simulation = root.child("SimulationParameters");
        let simulation = simulation.as_ref();
        let number = |name, default| number_or(simulation, document, "SimulationParameters", name, default);
        let mut switches = Switches {
            air_drag: number("airDrag", 3e-4),
            strand_friction: number("hairHairFrictionCoefficient", 0.3),
            solid_friction: number("hairMeshFrictionCoefficient", 0.0),
            skip_strand_strand: flag_or(simulation, "skipRodRodCollisions", false),
            skip_strand_solid: flag_or(simulation, "skipRodMeshCollisions", false),
            solve_liquids: flag_or(simulation, "solveLiquids", true),
            parts: simulation.and_then(|s| s.parameter_number("subSteps")).unwrap_or(Sited::made(1.0)),
            contacts_per_edge: None,
            strand_contact_radius: Sited::made(0.005),
            solid_contact_radius: Sited::made(0.005),
        };
        list(simulation, Heading::Machinery, MACHINERY);
        if let Some(parts) = simulation.and_then(|s| s.parameter_integer("rodSubSteps"))
            && parts.value != 1
        {
            let what = format!("SimulationParameters/rodSubSteps = {}", parts.value);
            document.note(Heading::NotHonoured, parts.span, what, "rods take one step per step of the scene");
        }
        let kept = "as here";
        let only = |name, usual, otherwise| only_if(simulation, name, usual, Heading::NotHonoured, otherwise, kept);
        only("useLengthProjection", false, "strands keep their length by their own stiffness, without a projection");
        only("useImpulseMethod", false, "contact is solved as one frictional problem, not by impulses");
        only("useNonlinearContacts", false, "`contact.relinearisations` does it; the default is one");
        only("useSoftAttachConstraints", false, "held vertices are held exactly");
        only("skipFlowFrictions", true, "friction of films in contacts has no such second law here");
        let collision = root.child("CollisionParameters");
        switches.read_collision(collision.as_ref(), document);
        switches
    }

    fn read_collision(&mut self, section: Option<&Element<'_, '_>>, document: &crate::import::document::Document<'_>) {
        let Some(element) = section else { return };
        for (name, mine, instead) in [
            ("frictionCoefficient", &mut self.strand_friction, "hairHairFrictionCoefficient"),
            ("meshFrictionCoefficient", &mut self.solid_friction, "hairMeshFrictionCoefficient"),
        ] {
            if let Some(given) = element.parameter_number(name) {
                let what = format!("CollisionParameters/{name} = {}", given.value);
                document.note(Heading::Fault, given.span, what, format!("overrides {instead} = {}", mine.value));
                *mine = given;
            }
        }
        self.contacts_per_edge = element.parameter_integer("maxNumCollisionsPerEdge");
        if let Some(radius) = element.parameter_number("selfCollisionsRadius") {
            self.strand_contact_radius = radius;
        }
        if let Some(radius) = element.parameter_number("externalCollisionsRadius") {
            self.solid_contact_radius = radius;
        }
        list(
            section,
            Heading::Machinery,
            &[
                ("constantCollisionRadius", "strands touch at their own radius"),
                ("impulseMaxNorm", "impulses are not cut off"),
                ("fakeLayering", "no layering"),
            ],
        );
        for name in ["reactsToSelfCollisions", "createsSelfCollisions"] {
            only_if(section, name, true, Heading::NotHonoured, "strands may touch themselves here", "as here");
        }
    }
}
