//! Counters of a run.

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// accepted steps
    pub steps: u64,
    /// changes of pairs
    pub events: u64,
    /// solutions whose mode differs from the one before
    pub mode_changes: u64,
    /// steps solved by the affine map or factor of the present mode
    pub quick_steps: u64,
    /// complementarity problems solved by the driver
    pub problems: u64,
    /// steps from a mode that leaves some voltage or current undetermined
    pub undetermined: u64,
    /// highest driver stage needed
    pub worst_stage: u8,
    /// switch operations
    pub switchings: u64,
    /// jumps of charges or fluxes
    pub jumps: u64,
    /// instants whose values are limits of short steps, since no closed form was found
    pub short_steps: u64,
    /// instants at which a switch did not come to rest
    pub chatter: u64,
    /// worst residual of rows over all checked steps
    pub residual_rows: f64,
    /// worst complementarity residual over all checked steps
    pub residual_complementarity: f64,
    /// residual checks made
    pub checks: u64,
    /// problems linearised by Newton's method
    pub linearised: u64,
    /// worst residual of the laws at the points of a path that is followed, not solved
    pub grid_residual: f64,
}
