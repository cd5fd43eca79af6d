//! Decomposition of a deformation gradient in the yarn frame.

use nalgebra::{SMatrix, SVector};

/// Most cross-section directions there can be (two in 3-D).
pub(super) const SECTION: usize = 2;

/// A deformation gradient seen from the yarn: `F = q (stretch, shearᵀ) + Σ_i s_i u_i v_iᵀ`.
///
/// `q` is the unit tangent, `shear` the part of the cross-section columns along it, and `s_i`, `u_i`, `v_i` the signed
/// singular triplets of what is left (one in 2-D, two in 3-D). It carries the same information as the triangular factor of
/// `F = Q R` with `R₁₁ > 0`: `stretch = R₁₁`, `shear = (R₁₂, R₁₃)`, and `s_i` are the singular values of the lower block, the
/// sign of `det F` being on the last one. `(q, u_1[, u_2])` is right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YarnFrame<const D: usize> {
    /// Unit tangent of the yarn.
    pub tangent: SVector<f64, D>,
    /// Stretch along the yarn, `R₁₁ > 0`.
    pub stretch: f64,
    /// Fibre shear `(R₁₂, R₁₃)`; the second entry is zero in 2-D.
    pub shear: [f64; SECTION],
    /// Principal stretches of the cross-section, largest first, the sign of `det F` on the last; one in 2-D.
    pub section: [f64; SECTION],
    /// Spatial principal directions `u_i`, normal to the tangent.
    pub directions: [SVector<f64, D>; SECTION],
    /// Material principal directions `v_i` among the cross-section columns.
    pub material: [[f64; SECTION]; SECTION],
    /// The tangent could not be taken from the first column (zero-length segment) and comes from the cross-section.
    pub degenerate: bool,
}

/// Length ratio below which a segment counts as having no direction.
const NO_LENGTH: f64 = 1e-9;

impl<const D: usize> YarnFrame<D> {
    /// Number of cross-section directions, `D - 1`.
    pub const SECTIONS: usize = D - 1;

    /// Decomposes `deformation`, whose first column follows the yarn.
    ///
    /// A first column shorter than 1e-9 has no direction: the tangent is then the normal of the cross-section columns
    /// and the stretch 1e-9, so that every later force is finite.
    #[inline]
    #[must_use]
    pub fn new(deformation: &SMatrix<f64, D, D>) -> Self {
        const { assert!(D == 2 || D == 3, "yarns live in two or three dimensions") };
        let first: SVector<f64, D> = deformation.column(0).into_owned();
        let length = first.norm();
        let degenerate = length < NO_LENGTH;
        let (tangent, stretch) =
            if degenerate { (section_normal(deformation), NO_LENGTH) } else { (first / length, length) };

        let mut shear = [0.0; SECTION];
        let mut normal_part = [SVector::<f64, D>::zeros(); SECTION];
        for a in 1..D {
            let column: SVector<f64, D> = deformation.column(a).into_owned();
            shear[a - 1] = tangent.dot(&column);
            normal_part[a - 1] = column - tangent * shear[a - 1];
        }
        let mut frame = Self {
            tangent,
            stretch,
            shear,
            section: [1.0; SECTION],
            directions: [SVector::zeros(); SECTION],
            material: [[1.0, 0.0], [0.0, 1.0]],
            degenerate,
        };
        if D == 2 {
            let normal = quarter_turn(&tangent);
            frame.directions[0] = normal;
            frame.section[0] = normal.dot(&normal_part[0]);
        } else {
            frame.split_section(&normal_part);
        }
        frame
    }

    /// Signed singular triplets of the two cross-section columns of a 3-D point.
    #[inline]
    fn split_section(&mut self, part: &[SVector<f64, D>; SECTION]) {
        // Eigenvectors of the 2×2 right Cauchy–Green block; the angle comes from the half-angle form, which is stable for
        // equal stretches (any direction will do there, and the law is isotropic in the section).
        let (c11, c22, c12) = (part[0].norm_squared(), part[1].norm_squared(), part[0].dot(&part[1]));
        let half_difference = 0.5 * (c11 - c22);
        let radius = (half_difference * half_difference + c12 * c12).sqrt();
        let v = if radius > 0.0 {
            // cos 2θ, sin 2θ → cos θ, sin θ without cancellation.
            let (cos2, sin2) = (half_difference / radius, c12 / radius);
            if cos2 >= 0.0 {
                let cos = (0.5 * (1.0 + cos2)).sqrt();
                [cos, sin2 / (2.0 * cos)]
            } else {
                let sin = (0.5 * (1.0 - cos2)).sqrt();
                [sin2 / (2.0 * sin), sin]
            }
        } else {
            [1.0, 0.0]
        };
        let w = [-v[1], v[0]];
        let long = part[0] * v[0] + part[1] * v[1];
        let short = part[0] * w[0] + part[1] * w[1];
        let length = long.norm();
        let first = if length > f64::MIN_POSITIVE { long / length } else { any_normal(&self.tangent) };
        let second = cross(&self.tangent, &first);
        self.directions = [first, second];
        self.material = [v, w];
        self.section = [length, second.dot(&short)];
    }

    /// Puts the deformation gradient together again.
    #[inline]
    #[must_use]
    pub fn compose(&self) -> SMatrix<f64, D, D> {
        let mut deformation = SMatrix::<f64, D, D>::zeros();
        deformation.set_column(0, &(self.tangent * self.stretch));
        for a in 1..D {
            let mut column = self.tangent * self.shear[a - 1];
            for i in 0..D - 1 {
                column += self.directions[i] * (self.section[i] * self.material[i][a - 1]);
            }
            deformation.set_column(a, &column);
        }
        deformation
    }

    /// Shear resolved on the principal directions, `v_i · shear`.
    #[inline]
    #[must_use]
    pub fn principal_shear(&self) -> [f64; SECTION] {
        let mut resolved = [0.0; SECTION];
        for i in 0..D - 1 {
            for a in 0..D - 1 {
                resolved[i] += self.material[i][a] * self.shear[a];
            }
        }
        resolved
    }
}

/// Upper triangular factor `R` of `F = Q R` with `det Q = 1`, positive diagonal but for the last entry, which has the sign of `det F`.
///
/// Meant for output and tests; the law itself works on [`YarnFrame`].
#[must_use]
pub fn triangular_factor<const D: usize>(deformation: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let frame = YarnFrame::new(deformation);
    let mut factor = SMatrix::<f64, D, D>::zeros();
    factor[(0, 0)] = frame.stretch;
    for a in 1..D {
        factor[(0, a)] = frame.shear[a - 1];
    }
    if D == 2 {
        factor[(1, 1)] = frame.section[0];
        return factor;
    }
    let column = |a: usize| deformation.column(a).into_owned() - frame.tangent * frame.shear[a - 1];
    let (second, third) = (column(1), column(2));
    let length = second.norm();
    let q2 = if length > f64::MIN_POSITIVE { second / length } else { any_normal(&frame.tangent) };
    factor[(1, 1)] = length;
    factor[(1, 2)] = q2.dot(&third);
    factor[(2, 2)] = cross(&frame.tangent, &q2).dot(&third);
    factor
}

/// A vector turned by +90° in 2-D.
#[inline]
pub(super) fn quarter_turn<const D: usize>(v: &SVector<f64, D>) -> SVector<f64, D> {
    let mut turned = SVector::zeros();
    turned[0] = -v[1];
    turned[1] = v[0];
    turned
}

/// Cross product of two 3-D vectors.
#[inline]
pub(super) fn cross<const D: usize>(a: &SVector<f64, D>, b: &SVector<f64, D>) -> SVector<f64, D> {
    let mut c = SVector::zeros();
    for i in 0..D {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        c[i] = a[j] * b[k] - a[k] * b[j];
    }
    c
}

/// Some unit vector normal to the unit vector `t`.
#[inline]
pub(super) fn any_normal<const D: usize>(t: &SVector<f64, D>) -> SVector<f64, D> {
    let mut least = 0;
    for i in 1..D {
        if t[i].abs() < t[least].abs() {
            least = i;
        }
    }
    let mut axis = SVector::<f64, D>::zeros();
    axis[least] = 1.0;
    let normal = axis - t * t[least];
    normal / normal.norm()
}

/// Unit normal of the cross-section columns; the first axis where they have none.
fn section_normal<const D: usize>(deformation: &SMatrix<f64, D, D>) -> SVector<f64, D> {
    let second: SVector<f64, D> = deformation.column(1).into_owned();
    let normal = if D == 2 { -quarter_turn(&second) } else { cross(&second, &deformation.column(D - 1).into_owned()) };
    let length = normal.norm();
    if length > f64::MIN_POSITIVE {
        normal / length
    } else {
        let mut axis = SVector::zeros();
        axis[0] = 1.0;
        axis
    }
}
