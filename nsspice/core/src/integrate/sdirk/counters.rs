//! What a run counts.

/// What has been done besides the counters of the stepper.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counters {
    /// steps taken again with a shorter length because of their error
    pub rejected: u64,
    /// instants at which a mode was found to end
    pub located: u64,
    /// steps over ends of modes that need no location
    pub passed: u64,
    /// single implicit steps over events that could not be located
    pub forced: u64,
    /// matrices assembled
    pub matrices: u64,
}
