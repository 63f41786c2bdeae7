//! Stretches as an engine hands them to the checks.

use super::Stretches;

/// Recorded stretches, flat; see [`Stretches`].
#[derive(Clone, Debug, Default)]
#[allow(missing_docs)] // as there
pub struct Taken {
    pub nodes: usize,
    pub known: f64,
    pub begin: Vec<f64>,
    pub end: Vec<f64>,
    pub grain: Vec<f64>,
    pub swing: Vec<f64>,
    pub steps: Vec<u8>,
    pub signed: Vec<u8>,
    pub doubt: Vec<f64>,
    pub first: Vec<f64>,
    pub first_u: Vec<f64>,
    pub time: Vec<f64>,
    pub weight: Vec<f64>,
    pub inner: Vec<f64>,
    pub z: Vec<f64>,
    pub rate: Vec<f64>,
    pub l: Vec<f64>,
    pub u: Vec<f64>,
    pub function_rate: Vec<f64>,
    pub roles: Vec<u8>,
    pub seam_end: Vec<f64>,
    pub seam_begin: Vec<f64>,
    pub seams: usize,
}

impl Taken {
    /// The same for the checks.
    pub fn view(&self) -> Stretches<'_> {
        Stretches {
            nodes: self.nodes,
            known: self.known,
            begin: &self.begin,
            end: &self.end,
            grain: &self.grain,
            swing: &self.swing,
            steps: &self.steps,
            signed: &self.signed,
            doubt: &self.doubt,
            first: &self.first,
            first_u: &self.first_u,
            time: &self.time,
            weight: &self.weight,
            inner: &self.inner,
            z: &self.z,
            rate: &self.rate,
            l: &self.l,
            u: &self.u,
            function_rate: &self.function_rate,
            roles: &self.roles,
            seam_end: &self.seam_end,
            seam_begin: &self.seam_begin,
        }
    }

    /// Numbers that wait.
    pub fn size(&self) -> usize {
        2 * self.z.len()
            + self.l.len()
            + self.u.len()
            + self.function_rate.len()
            + 2 * self.seam_end.len()
    }
}
