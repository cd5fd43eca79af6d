//! Strands cut out of the flat arrays, in parallel and without allocation.

use nalgebra::Vector3;

use crate::report::FilmReport;
use crate::state::{End, FilmState, Parts, StrandSlices};

/// Numbers of scratch per vertex.
pub(crate) const WORK: usize = 6;

/// One strand: its film, its scratch and what it sees.
pub(crate) struct Strand<'a> {
    pub index: usize,
    pub area: &'a mut [f64],
    pub log_strain: &'a mut [f64],
    pub velocity: &'a mut [f64],
    pub reservoir: &'a mut [f64; 2],
    pub ends: [End; 2],
    /// Volume that crossed each edge during the step [m³].
    pub crossed: &'a mut [f64],
    /// `WORK` numbers per vertex.
    pub work: &'a mut [f64],
    pub edge_length: &'a [f64],
    pub tangent: &'a [Vector3<f64>],
    pub semi_axes: &'a [[f64; 2]],
    pub acceleration: &'a [Vector3<f64>],
}

impl Strand<'_> {
    /// Half the adjacent edges [m].
    #[inline]
    pub fn vertex_length(&self, i: usize) -> f64 {
        let before = if i > 0 { self.edge_length[i - 1] } else { 0.0 };
        let after = if i < self.edge_length.len() { self.edge_length[i] } else { 0.0 };
        0.5 * (before + after)
    }

    /// Sum of the semi-axes of the strand on an edge [m].
    #[inline]
    pub fn edge_axes(&self, j: usize) -> f64 {
        0.5 * (self.semi_axes[j][0] + self.semi_axes[j][1] + self.semi_axes[j + 1][0] + self.semi_axes[j + 1][1])
    }

    /// Cross-section below which a vertex counts as dry [m²].
    #[inline]
    pub fn dry_area(&self, i: usize, fraction: f64) -> f64 {
        fraction * std::f64::consts::PI * self.semi_axes[i][0] * self.semi_axes[i][1]
    }
}

/// A run of strands with their shares of all arrays.
struct Block<'a> {
    first: usize,
    /// Starts of these strands and the end of the last, in the whole arrays.
    start: &'a [usize],
    area: &'a mut [f64],
    log_strain: &'a mut [f64],
    velocity: &'a mut [f64],
    reservoir: &'a mut [[f64; 2]],
    ends: &'a [[End; 2]],
    crossed: &'a mut [f64],
    work: &'a mut [f64],
    view: StrandSlices<'a>,
}

impl<'a> Block<'a> {
    fn split(self, strands: usize) -> (Block<'a>, Block<'a>) {
        let vertices = self.start[strands] - self.start[0];
        let edges = vertices - strands;
        let (area, area_right) = self.area.split_at_mut(vertices);
        let (log_strain, log_strain_right) = self.log_strain.split_at_mut(vertices);
        let (velocity, velocity_right) = self.velocity.split_at_mut(edges);
        let (reservoir, reservoir_right) = self.reservoir.split_at_mut(strands);
        let (ends, ends_right) = self.ends.split_at(strands);
        let (crossed, crossed_right) = self.crossed.split_at_mut(edges);
        let (work, work_right) = self.work.split_at_mut(WORK * vertices);
        let (edge_length, edge_length_right) = self.view.edge_length.split_at(edges);
        let (tangent, tangent_right) = self.view.tangent.split_at(edges);
        let (semi_axes, semi_axes_right) = self.view.semi_axes.split_at(vertices);
        let (acceleration, acceleration_right) = self.view.acceleration.split_at(vertices);
        let left = Block {
            first: self.first,
            start: &self.start[..=strands],
            area,
            log_strain,
            velocity,
            reservoir,
            ends,
            crossed,
            work,
            view: StrandSlices { edge_length, tangent, semi_axes, acceleration },
        };
        let right = Block {
            first: self.first + strands,
            start: &self.start[strands..],
            area: area_right,
            log_strain: log_strain_right,
            velocity: velocity_right,
            reservoir: reservoir_right,
            ends: ends_right,
            crossed: crossed_right,
            work: work_right,
            view: StrandSlices {
                edge_length: edge_length_right,
                tangent: tangent_right,
                semi_axes: semi_axes_right,
                acceleration: acceleration_right,
            },
        };
        (left, right)
    }

    fn only(self) -> Strand<'a> {
        Strand {
            index: self.first,
            area: self.area,
            log_strain: self.log_strain,
            velocity: self.velocity,
            reservoir: &mut self.reservoir[0],
            ends: self.ends[0],
            crossed: self.crossed,
            work: self.work,
            edge_length: self.view.edge_length,
            tangent: self.view.tangent,
            semi_axes: self.view.semi_axes,
            acceleration: self.view.acceleration,
        }
    }
}

/// Vertices below which a run of strands is not worth handing to another thread.
const GRAIN: usize = 1024;

/// Calls `f` for every strand and merges the reports in the order of the strands. The tree of merging depends on the strands
/// alone, so sums have the same bits on any number of threads.
pub(crate) fn for_each_strand(
    state: &mut FilmState,
    view: StrandSlices<'_>,
    crossed: &mut [f64],
    work: &mut [f64],
    f: &(impl Fn(Strand<'_>) -> FilmReport + Sync),
) -> FilmReport {
    if state.strands() == 0 {
        return FilmReport::default();
    }
    let Parts { start, area, log_strain, velocity, reservoir, ends } = state.parts();
    let block = Block { first: 0, start, area, log_strain, velocity, reservoir, ends, crossed, work, view };
    visit(block, f)
}

fn visit(block: Block<'_>, f: &(impl Fn(Strand<'_>) -> FilmReport + Sync)) -> FilmReport {
    let strands = block.start.len() - 1;
    if strands == 1 {
        return f(block.only());
    }
    let vertices = block.start[strands] - block.start[0];
    let (left, right) = block.split(strands / 2);
    let (a, b) = if vertices > GRAIN {
        rayon::join(|| visit(left, f), || visit(right, f))
    } else {
        (visit(left, f), visit(right, f))
    };
    a.merged(b)
}
