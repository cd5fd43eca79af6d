//! One interface over the two modes, so that preparation and experiments are written once.

use crate::cell::{Boundary, Cell};
use crate::compat::DirectedSample;
use crate::error::GranularError;
use crate::grains::Grains;
use crate::model::{ContactKind, ContactModel, Mode};
use crate::physical::{Rules, Sample, StepReport};
use crate::spheres::SphereSample;
use serde::{Deserialize, Serialize};

/// How grains at the edges of the box are carried while the sample is sheared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Plates {
    /// No plates: the box edges alone drive the shear, as in a bulk sample (default of the physical mode).
    #[default]
    None,
    /// Grains that touch a plate line when the plates engage are carried, without spin, until the end.
    Fixed,
    /// Whoever touches a plate line is carried and never let go (rule of the compat mode).
    Band,
}

/// One contact as seen from outside: for particles, frames and statistics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactView {
    /// First grain.
    pub i: u32,
    /// Second grain.
    pub j: u32,
    /// Stick, slip or permanent.
    pub kind: ContactKind,
    /// Vector from the first grain to the image of the second [µm]; of spheres its projection.
    pub separation: [f64; 2],
    /// True if the image is the grain itself, not a copy across an edge.
    pub direct: bool,
    /// Elastic central force, negative in compression [µm mg s⁻²/m].
    pub normal_force: f64,
    /// Elastic tangential force [µm mg s⁻²/m].
    pub tangential_force: f64,
}

/// A sample of either mode.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Assembly {
    /// Compat mode.
    Directed(Box<DirectedSample>),
    /// Physical mode.
    Undirected(Box<Sample>),
    /// Physical mode, spheres.
    Spheres(Box<SphereSample>),
}

impl Assembly {
    /// Creates a sample without contacts; `seed` serves the directions of coincident centres in compat mode.
    ///
    /// # Errors
    /// [`GranularError`] if the grains or rules are inadmissible, or compat mode is asked for another box than Lees–Edwards.
    pub fn new(
        mode: Mode,
        grains: &Grains,
        cell: Cell,
        model: ContactModel,
        rules: Rules,
        seed: u64,
    ) -> Result<Self, GranularError> {
        match mode {
            Mode::Compat if cell.boundary != Boundary::LeesEdwards => {
                Err(GranularError::State("the compat mode knows the Lees–Edwards box only".into()))
            }
            Mode::Compat => {
                grains.check(0.0)?;
                Ok(Self::Directed(Box::new(DirectedSample::new(grains.clone(), cell, model, seed))))
            }
            Mode::Physical => Ok(Self::Undirected(Box::new(Sample::new(grains, cell, model, rules)?))),
        }
    }

    /// Number of grains.
    pub fn len(&self) -> usize {
        match self {
            Self::Directed(s) => s.grains.len(),
            Self::Undirected(s) => s.len(),
            Self::Spheres(s) => s.len(),
        }
    }

    /// True without grains.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Grains, wrapped into the box; of spheres the projection along the vorticity.
    pub fn grains(&self) -> Grains {
        match self {
            Self::Directed(s) => s.grains.clone(),
            Self::Undirected(s) => s.grains(),
            Self::Spheres(s) => {
                let mut g = Grains::default();
                for b in &s.balls {
                    let ([x, y], kick) = s.cell.wrap(b.position[0], b.position[1]);
                    g.push([x, y], b.radius, 1.0 / b.inverse_mass);
                    let i = g.len() - 1;
                    (g.vx[i], g.vy[i], g.omega[i]) = (b.velocity[0] + kick, b.velocity[1], b.omega[2]);
                    g.inertia[i] = 1.0 / b.inverse_inertia;
                }
                g
            }
        }
    }

    /// The box.
    pub fn cell(&self) -> &Cell {
        match self {
            Self::Directed(s) => &s.cell,
            Self::Undirected(s) => s.cell(),
            Self::Spheres(s) => &s.cell,
        }
    }

    /// Contact laws.
    pub fn model(&self) -> &ContactModel {
        match self {
            Self::Directed(s) => &s.model,
            Self::Undirected(s) => s.model(),
            Self::Spheres(s) => &s.model,
        }
    }

    /// Contact laws, to be changed between steps.
    pub fn model_mut(&mut self) -> &mut ContactModel {
        match self {
            Self::Directed(s) => &mut s.model,
            Self::Undirected(s) => s.model_mut(),
            Self::Spheres(s) => &mut s.model,
        }
    }

    /// Sets the shear rate [1/s] with the matching jump of all velocities.
    pub fn set_rate(&mut self, rate: f64) {
        match self {
            Self::Directed(s) => s.set_rate(rate),
            Self::Undirected(s) => s.set_rate(rate),
            Self::Spheres(s) => s.set_rate(rate),
        }
    }

    /// Advances by one step and returns the state at its beginning. `record` asks for the tensors, which compat mode
    /// computes only then; `zero_forces` matters in compat mode only.
    ///
    /// # Errors
    /// See [`Sample::advance`] and [`DirectedSample::integrate`].
    pub fn advance(
        &mut self,
        dt: f64,
        damping: f64,
        zero_forces: bool,
        record: bool,
    ) -> Result<StepReport, GranularError> {
        match self {
            Self::Undirected(s) => s.advance(dt, damping),
            Self::Spheres(s) => s.advance(dt, damping),
            Self::Directed(s) => {
                s.evaluate();
                let mut report = StepReport { substeps: 1, ..StepReport::default() };
                if record {
                    report.stress = s.stresses();
                    let kinds = || s.contacts.iter().flatten().map(|c| c.kind);
                    report.contacts = (kinds().count() / 2) as u32;
                    report.slipping = (kinds().filter(|k| *k == ContactKind::Slip).count() / 2) as u32;
                    report.kinetic_energy = s.grains.kinetic_energy(s.cell.rate, s.cell.height / 2.0);
                }
                s.integrate(dt, damping, zero_forces)?;
                Ok(report)
            }
        }
    }

    /// Engages or releases the plates; compat mode always carries by position.
    ///
    /// # Errors
    /// [`GranularError::NothingMovable`] if no grain is left free.
    pub fn set_plates(&mut self, plates: Plates) -> Result<(), GranularError> {
        match self {
            Self::Directed(s) => {
                s.applying_shear = plates != Plates::None;
                if (0..s.grains.len()).any(|i| s.movable(i)) {
                    Ok(())
                } else {
                    Err(GranularError::NothingMovable { time: s.time })
                }
            }
            Self::Undirected(s) => match plates {
                Plates::None => {
                    s.release_plates();
                    Ok(())
                }
                Plates::Fixed | Plates::Band => s.attach_plates().map(|_| ()),
            },
            Self::Spheres(_) if plates == Plates::None => Ok(()),
            Self::Spheres(_) => Err(GranularError::State("spheres are sheared without plates".into())),
        }
    }

    /// In physical mode with plates that capture, carries whoever has come to touch a plate line since.
    pub fn capture(&mut self) {
        if let Self::Undirected(s) = self {
            s.capture();
        }
    }

    /// Subtracts the mean velocity, unweighted.
    pub fn remove_drift(&mut self) {
        match self {
            Self::Directed(s) => {
                let n = s.grains.len() as f64;
                for v in [&mut s.grains.vx, &mut s.grains.vy] {
                    let mean = v.iter().sum::<f64>() / n;
                    v.iter_mut().for_each(|c| *c -= mean);
                }
            }
            Self::Undirected(s) => s.remove_drift(),
            Self::Spheres(s) => s.remove_drift(),
        }
    }

    /// Links every listed contact permanently.
    pub fn link_all(&mut self) {
        match self {
            Self::Directed(s) => s.link_all(),
            Self::Undirected(s) => s.link_all(),
            Self::Spheres(s) => s.link_all(),
        }
    }

    /// Links two touching grains at touching distance.
    pub fn link(&mut self, i: usize, j: usize) {
        match self {
            Self::Directed(s) => s.link(i, j),
            Self::Undirected(s) => {
                let rest = s.bodies[i].radius + s.bodies[j].radius;
                s.link(i, j, rest);
            }
            Self::Spheres(s) => {
                let rest = s.balls[i].radius + s.balls[j].radius;
                s.link(i, j, rest);
            }
        }
    }

    /// Cuts a permanent link.
    pub fn cut(&mut self, i: usize, j: usize) {
        match self {
            Self::Directed(s) => s.cut(i, j),
            Self::Undirected(s) => s.cut(i, j),
            Self::Spheres(s) => s.cut(i, j),
        }
    }

    /// Permanent links, each once.
    pub fn links(&self) -> Vec<[usize; 2]> {
        match self {
            Self::Directed(s) => s.links(),
            Self::Undirected(s) => s.links(),
            Self::Spheres(s) => s
                .pairs
                .iter()
                .filter(|p| p.kind == ContactKind::Permanent)
                .map(|p| [p.i as usize, p.j as usize])
                .collect(),
        }
    }

    /// Every contact once, with its elastic forces.
    pub fn contacts(&self) -> Vec<ContactView> {
        let model = self.model();
        let [fc, _, ft, _] = model.permanent_factors();
        let view = |i: u32, j: u32, kind, spring: f64, rest: f64, touch: f64, separation: [f64; 2], direct, d: f64| {
            let (normal_force, tangential_force) = if kind == ContactKind::Permanent {
                (model.link_force(d, rest) * fc, model.tangential_spring * ft * spring)
            } else {
                (model.law.force(d, touch, model.spring), model.tangential_spring * spring)
            };
            ContactView { i, j, kind, separation, direct, normal_force, tangential_force }
        };
        let flat = |s: [f64; 2]| (s[0] * s[0] + s[1] * s[1]).sqrt();
        match self {
            Self::Spheres(s) => s
                .pairs
                .iter()
                .filter(|p| p.kind != ContactKind::Apart)
                .map(|p| {
                    let v = s.separation(p);
                    let touch = s.balls[p.i as usize].radius + s.balls[p.j as usize].radius;
                    let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
                    let (d, spring) = (length(v), length(p.spring));
                    view(p.i, p.j, p.kind, spring, p.rest, touch, [v[0], v[1]], p.image == [0; 3], d)
                })
                .collect(),
            Self::Directed(s) => {
                let g = &s.grains;
                let mut views = Vec::new();
                for (i, list) in s.contacts.iter().enumerate() {
                    for c in list.iter().filter(|c| i < c.other as usize) {
                        let j = c.other as usize;
                        let (separation, _, wrapped) = s.cell.nearest(g.x[j] - g.x[i], g.y[j] - g.y[i]);
                        let touch = g.radius[i] + g.radius[j];
                        views.push(view(
                            i as u32,
                            c.other,
                            c.kind,
                            c.spring,
                            c.rest,
                            touch,
                            separation,
                            !wrapped,
                            flat(separation),
                        ));
                    }
                }
                views
            }
            Self::Undirected(s) => (0..s.pairs.len())
                .filter(|&k| s.kind[k] != ContactKind::Apart)
                .map(|k| {
                    let p = s.pairs[k];
                    let touch = s.bodies[p.i as usize].radius + s.bodies[p.j as usize].radius;
                    let direct = p.columns == 0 && p.rows == 0;
                    view(
                        p.i,
                        p.j,
                        s.kind[k],
                        s.spring[k],
                        s.rest[k],
                        touch,
                        s.separation(&p),
                        direct,
                        flat(s.separation(&p)),
                    )
                })
                .collect(),
        }
    }
}
