//! The exact stiffness matrix of one strand, for stability and modes.
//!
//! Assembled element by element in single numbers, apart from the lane kernel, which it thereby checks.

use crate::boundary::Boundary;
use crate::coefficients::{bend_twist_stiffness, edge_inertia, stretch_stiffness, vertex_mass};
use crate::kernel::W;
use crate::loads::Loads;
use crate::state::RodSet;
use constitutive::curvature::{vertex_gradient, vertex_hessian};
use numerics::banded::Band;

impl RodSet {
    /// Gradient of the elastic energy of a strand: `4 i + c` for component `c` of vertex `i` \[N\], `4 j + 3` for the angle
    /// of edge `j` \[N m\]; the last entry is zero.
    #[must_use]
    pub fn elastic_gradient(&self, strand: usize) -> Vec<f64> {
        let n = self.vertices(strand).len();
        let mut out = vec![0.0; 4 * n];
        for j in 0..n - 1 {
            let (t, l) = self.tangent(strand, j);
            let e = self.edges(strand).start + j;
            let force = t * (stretch_stiffness(self, strand, j) * (l / self.rest_length[e] - 1.0));
            for c in 0..3 {
                out[4 * j + c] -= force[c];
                out[4 * j + 4 + c] += force[c];
            }
            if j > 0 {
                let (x, m) = self.element(strand, j);
                let g = vertex_gradient(&self.law(strand, j).gradient(&x, m));
                for k in 0..11 {
                    out[4 * (j - 1) + k] += g[k];
                }
            }
        }
        out
    }

    /// Exact Hessian of the elastic energy of a strand (spec 4.4, corrected), in the unknowns of [`elastic_gradient`](Self::elastic_gradient).
    #[must_use]
    pub fn elastic_hessian(&self, strand: usize) -> Band<W> {
        let n = self.vertices(strand).len();
        let mut out = Band::<W>::zeros(4 * n);
        for j in 0..n - 1 {
            let (t, l) = self.tangent(strand, j);
            let rest = self.rest_length[self.edges(strand).start + j];
            let ks = stretch_stiffness(self, strand, j);
            let (across, along) = (ks * (1.0 / rest - 1.0 / l), ks / l);
            for r in 0..3 {
                for c in 0..3 {
                    let v = along * t[r] * t[c] + if r == c { across } else { 0.0 };
                    for (row, column, sign) in [(0, 0, 1.0), (4, 4, 1.0), (4, 0, -1.0)] {
                        let (row, column) = (4 * j + row + r, 4 * j + column + c);
                        if row >= column {
                            out.columns[column][row - column] += sign * v;
                        }
                    }
                }
            }
            if j > 0 {
                let (x, m) = self.element(strand, j);
                let h = vertex_hessian(&self.law(strand, j).gradient_hessian::<true>(&x, m).1);
                for c in 0..11 {
                    for r in c..11 {
                        out.columns[4 * (j - 1) + c][r - c] += h[(r, c)];
                    }
                }
            }
        }
        out
    }

    /// Diagonal mass of a strand in the unknowns of [`elastic_gradient`](Self::elastic_gradient) \[kg, kg m²\].
    #[must_use]
    pub fn mass_diagonal(&self, strand: usize, loads: &Loads) -> Vec<f64> {
        let n = self.vertices(strand).len();
        let mut out = vec![0.0; 4 * n];
        for (i, v) in self.vertices(strand).enumerate() {
            let mass = vertex_mass(self, strand, i) + loads.film_mass.map_or(0.0, |m| m[v]);
            out[4 * i..4 * i + 3].fill(mass);
            if i + 1 < n {
                out[4 * i + 3] = edge_inertia(self, strand, i, loads.film_mass, loads.film_height);
            }
        }
        out
    }

    /// Whether each unknown of a strand is free under the boundary.
    #[must_use]
    pub fn free_unknowns(&self, strand: usize, boundary: &Boundary) -> Vec<bool> {
        let (v, e) = (self.vertices(strand), self.edges(strand));
        let mut free = vec![true; 4 * v.len()];
        free[4 * v.len() - 1] = false;
        for f in boundary.vertices.iter().filter(|f| v.contains(&f.vertex)) {
            for c in (0..3).filter(|c| f.components[*c]) {
                free[4 * (f.vertex - v.start) + c] = false;
            }
        }
        for f in boundary.edges.iter().filter(|f| e.contains(&f.edge)) {
            free[4 * (f.edge - e.start) + 3] = false;
        }
        free
    }

    /// The matrix `M^{-1/2} K M^{-1/2}` of a strand, whose eigenvalues are the squared angular frequencies \[rad²/s²\] of its small
    /// vibrations; held unknowns get an entry far above the others. The strand is stable if none is negative.
    #[must_use]
    pub fn vibration_matrix(&self, strand: usize, loads: &Loads, boundary: &Boundary) -> Band<W> {
        let mut k = self.elastic_hessian(strand);
        let mass = self.mass_diagonal(strand, loads);
        let free = self.free_unknowns(strand, boundary);
        let v = self.vertices(strand);
        for g in boundary.goals.iter().filter(|g| v.contains(&g.vertex)) {
            for c in 0..3 {
                k.columns[4 * (g.vertex - v.start) + c][0] += g.stiffness;
            }
        }
        let n = free.len();
        let mut largest = 0.0f64;
        for j in 0..n {
            for i in 0..W.min(n - j) {
                let entry = &mut k.columns[j][i];
                if free[j] && free[j + i] {
                    *entry /= (mass[j] * mass[j + i]).sqrt();
                    largest = largest.max(entry.abs());
                } else {
                    *entry = 0.0;
                }
            }
        }
        for j in (0..n).filter(|j| !free[*j]) {
            k.columns[j][0] = largest.max(1.0);
        }
        k
    }

    /// Number of negative eigenvalues of the stiffness of a strand under the boundary: zero for a stable equilibrium.
    #[must_use]
    pub fn unstable_modes(&self, strand: usize, loads: &Loads, boundary: &Boundary) -> usize {
        self.vibration_matrix(strand, loads, boundary).factor().negative
    }

    /// Natural angular frequency squared \[rad²/s²\] of the slowest mode; negative if unstable.
    #[must_use]
    pub fn slowest_mode(&self, strand: usize, loads: &Loads, boundary: &Boundary) -> f64 {
        slowest(&self.vibration_matrix(strand, loads, boundary))
    }

    /// Smaller bending stiffness over length squared \[N\]: the force scale of a strand without load.
    #[must_use]
    pub fn bending_force_scale(&self, strand: usize) -> f64 {
        let n = self.edges(strand).len();
        let length: f64 = self.rest_length[self.edges(strand)].iter().sum();
        let bend = (1..n).map(|i| {
            let (c0, c1, _) = bend_twist_stiffness(self, strand, i);
            2.0 * c0.min(c1) * self.vertex_length(strand, i)
        });
        bend.fold(0.0, f64::max) / (length * length)
    }
}

/// Smallest eigenvalue by inverse iteration with shifts certified by the inertia, to about ten digits.
fn slowest(k: &Band<W>) -> f64 {
    let n = k.columns.len();
    // bracket by inertia, relative to the slow end of the spectrum rather than the stiff one
    let mut scratch = Band::default();
    let trace = (0..n).map(|j| k.columns[j][0].abs()).fold(f64::INFINITY, f64::min).max(1e-300);
    let mut high = trace;
    while k.eigenvalues_below(high, &mut scratch) == 0 {
        high *= 4.0;
    }
    let mut low = 0.0;
    if k.eigenvalues_below(0.0, &mut scratch) > 0 {
        high = 0.0;
        low = -trace * 1e-6;
        while k.eigenvalues_below(low, &mut scratch) > 0 {
            low *= 4.0;
        }
    } else {
        while high > 1e-12 * trace && k.eigenvalues_below(0.25 * high, &mut scratch) > 0 {
            high *= 0.25;
        }
    }
    while high - low > 1e-10 * high.abs().max(low.abs()) {
        let mid = 0.5 * (low + high);
        if k.eigenvalues_below(mid, &mut scratch) > 0 {
            high = mid;
        } else {
            low = mid;
        }
    }
    0.5 * (low + high)
}
