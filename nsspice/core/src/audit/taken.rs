//! Stretches on their way from an engine to the checks.

/// Recorded stretches, flat; see [`super::Stretches`].
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
    /// Numbers that wait.
    pub fn size(&self) -> usize {
        2 * self.z.len()
            + self.l.len()
            + self.u.len()
            + self.function_rate.len()
            + 2 * self.seam_end.len()
    }
}
