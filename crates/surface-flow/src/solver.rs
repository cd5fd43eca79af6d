//! The film step.

use nalgebra::Vector3;

use crate::advect::{self, minmod};
use crate::block::{Strand, WORK, for_each_strand};
use crate::error::FilmError;
use crate::limit;
use crate::liquid::FilmLiquid;
use crate::relax;
use crate::report::FilmReport;
use crate::settings::FilmSettings;
use crate::shear;
use crate::state::{FilmState, StrandSlices, film_height};
use crate::wall::Wall;

/// Steps films; owns the scratch, so that no step allocates.
#[derive(Clone, Debug)]
pub struct FilmSolver {
    settings: FilmSettings,
    media: Vec<Medium>,
    /// Medium of each strand; empty: the first for all.
    medium_of: Vec<u32>,
    work: Vec<f64>,
    crossed: Vec<f64>,
}

/// A liquid on its strands.
#[derive(Clone, Copy, Debug)]
struct Medium {
    liquid: FilmLiquid,
    wall: Wall,
}

/// The medium of a strand.
fn medium<'a>(media: &'a [Medium], medium_of: &[u32], strand: usize) -> &'a Medium {
    &media[medium_of.get(strand).map_or(0, |place| *place as usize)]
}

impl FilmSolver {
    /// A solver for one liquid.
    ///
    /// # Errors
    /// [`FilmError::Parameter`] if a setting is out of range.
    pub fn new(liquid: FilmLiquid, settings: FilmSettings) -> Result<Self, FilmError> {
        Self::for_strands(&[(liquid, settings.slip_length)], Vec::new(), settings)
    }

    /// A solver for several liquids.
    ///
    /// - `media`: liquid and Navier slip length [m] of each; the slip length of the settings is not read
    /// - `medium_of`: place in `media` of each strand; empty: the first for all
    ///
    /// # Errors
    /// [`FilmError::Parameter`] if a setting is out of range, [`FilmError::Shape`] if there is no medium or a strand names
    /// one that is not there.
    pub fn for_strands(
        media: &[(FilmLiquid, f64)],
        medium_of: Vec<u32>,
        settings: FilmSettings,
    ) -> Result<Self, FilmError> {
        let most = medium_of.iter().max().map_or(0, |most| *most as usize) + 1;
        if media.len() < most {
            return Err(FilmError::Shape { what: "media", expected: most, found: media.len() });
        }
        let media = media
            .iter()
            .map(|(liquid, slip)| {
                FilmSettings { slip_length: *slip, ..settings }.check()?;
                Ok(Medium { liquid: *liquid, wall: Wall::new(settings.wall, liquid, *slip) })
            })
            .collect::<Result<_, FilmError>>()?;
        Ok(FilmSolver { settings, media, medium_of, work: Vec::new(), crossed: Vec::new() })
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &FilmSettings {
        &self.settings
    }

    /// The liquid (of the first medium).
    #[must_use]
    pub fn liquid(&self) -> &FilmLiquid {
        &self.media[0].liquid
    }

    /// The liquid on a strand.
    #[must_use]
    pub fn liquid_of(&self, strand: usize) -> &FilmLiquid {
        &medium(&self.media, &self.medium_of, strand).liquid
    }

    /// Friction on the strand (of the first medium).
    #[must_use]
    pub fn wall(&self) -> &Wall {
        &self.media[0].wall
    }

    /// Volume that crossed each edge during the last advection [m³], along the tangent.
    #[must_use]
    pub fn crossed_volume(&self) -> &[f64] {
        &self.crossed
    }

    /// One step up to the strain: advect, accelerate, rub, limit.
    ///
    /// - `gravity`: [m/s²]
    /// - `dt`: step [s], > 0
    ///
    /// # Errors
    /// [`FilmError::Shape`] if the slices do not fit (nothing is changed); [`FilmError::NonFinite`] if the film stopped being
    /// finite (the state is then to be restored).
    pub fn advance(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        gravity: Vector3<f64>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, true, &|strand, settings, medium| {
            let advected = advect::advect(strand, settings, medium.liquid.density, dt);
            shear::accelerate(strand, settings, &medium.liquid, gravity, dt);
            rub(strand, settings, &medium.wall, dt);
            advected.merged(limit::limit(strand, settings, dt))
        })
    }

    /// Everything that changes the velocities over `dt` [s], in one pass: accelerate, rub, limit.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn drive(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        gravity: Vector3<f64>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, false, &|strand, settings, medium| {
            shear::accelerate(strand, settings, &medium.liquid, gravity, dt);
            rub(strand, settings, &medium.wall, dt);
            limit::limit(strand, settings, dt)
        })
    }

    /// Carries the films along for `dt` [s].
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn advect(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, true, &|strand, settings, medium| {
            advect::advect(strand, settings, medium.liquid.density, dt)
        })
    }

    /// Gravity, acceleration of the strands and elastic force over `dt` [s].
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn accelerate(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        gravity: Vector3<f64>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, false, &|strand, settings, medium| {
            shear::accelerate(strand, settings, &medium.liquid, gravity, dt);
            FilmReport::default()
        })
    }

    /// Friction on the strands over `dt` [s].
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn rub(&mut self, state: &mut FilmState, strands: StrandSlices<'_>, dt: f64) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, false, &|strand, settings, medium| {
            rub(strand, settings, &medium.wall, dt);
            FilmReport::default()
        })
    }

    /// Limits speeds and steep bulges.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn limit(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, false, &|strand, settings, _| limit::limit(strand, settings, dt))
    }

    /// Stretches the strain by the velocities and lets it flow over `dt` [s] (stage 11).
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn relax(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        dt: f64,
    ) -> Result<FilmReport, FilmError> {
        self.visit(state, strands, dt, false, &|strand, settings, medium| {
            relax::relax(strand, settings, &medium.liquid, dt);
            FilmReport::default()
        })
    }

    /// Runs `stage` on every strand and adds the figures every stage reports.
    fn visit(
        &mut self,
        state: &mut FilmState,
        strands: StrandSlices<'_>,
        dt: f64,
        advects: bool,
        stage: &(impl Fn(&mut Strand<'_>, &FilmSettings, &Medium) -> FilmReport + Sync),
    ) -> Result<FilmReport, FilmError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(FilmError::Parameter { name: "step", value: dt, allowed: "finite, above 0 s" });
        }
        state.check_shapes(&strands)?;
        if !self.medium_of.is_empty() && self.medium_of.len() != state.strands() {
            let (expected, found) = (state.strands(), self.medium_of.len());
            return Err(FilmError::Shape { what: "media of the strands", expected, found });
        }
        self.work.resize(WORK * state.area.len(), 0.0);
        self.crossed.resize(state.velocity.len(), 0.0);
        if advects {
            self.crossed.fill(0.0);
        }
        let settings = self.settings;
        let (media, medium_of) = (&self.media, &self.medium_of);
        let dry = settings.dry_fraction;
        let report = for_each_strand(state, strands, &mut self.crossed, &mut self.work, &|mut strand| {
            let medium = medium(media, medium_of, strand.index);
            let mut report = stage(&mut strand, &settings, medium);
            let positive = |x: &f64| x.is_finite() && *x >= 0.0;
            let fine = strand.area.iter().all(positive)
                && strand.log_strain.iter().all(|x| x.is_finite())
                && strand.velocity.iter().all(|x| x.is_finite());
            if !fine {
                report.bad_strands = 1;
                report.first_bad = Some(strand.index);
            }
            for j in 0..strand.velocity.len() {
                if strand.area[j].max(strand.area[j + 1]) >= strand.dry_area(j, dry) {
                    report.wet += 1;
                    report.stuck += usize::from(strand.velocity[j] == 0.0);
                    report.max_speed = report.max_speed.max(strand.velocity[j].abs());
                }
            }
            report
        });
        match report.first_bad {
            None => Ok(report),
            Some(first) => Err(FilmError::NonFinite { strands: report.bad_strands, first }),
        }
    }

    /// Height of the film at a vertex [m].
    #[must_use]
    pub fn height(&self, state: &FilmState, strands: &StrandSlices<'_>, vertex: usize) -> f64 {
        film_height(state.area[vertex], strands.semi_axes[vertex][0] + strands.semi_axes[vertex][1])
    }
}

/// Friction of one film. The height is that of the film which crosses the edge, reconstructed from its upstream side as the
/// volume flux is: the flux of a film in balance is then the upwind flux of a kinematic wave, and fronts stay monotone.
fn rub(strand: &mut Strand<'_>, settings: &FilmSettings, wall: &Wall, dt: f64) {
    let velocity = std::mem::take(&mut strand.velocity);
    let edges = velocity.len();
    let dry = |i: usize| strand.area[i] < strand.dry_area(i, settings.dry_fraction);
    for j in 0..edges {
        if dry(j) && dry(j + 1) {
            velocity[j] = 0.0;
            continue;
        }
        let (from, side) = if velocity[j] > 0.0 { (j, 0.5) } else { (j + 1, -0.5) };
        let (area, length) = (&*strand.area, strand.edge_length);
        let crossing = if dry(from) {
            // a front's rear: nothing crosses, the edge moves with the film ahead of it
            0.5 * (area[j] + area[j + 1])
        } else if from > 0 && from < edges && !dry(from - 1) && !dry(from + 1) {
            let slope =
                minmod((area[from] - area[from - 1]) / length[from - 1], (area[from + 1] - area[from]) / length[from]);
            area[from] + side * length[j] * slope
        } else {
            area[from]
        };
        velocity[j] = wall.rub(velocity[j], film_height(crossing, strand.edge_axes(j)), dt);
    }
    strand.velocity = velocity;
}
