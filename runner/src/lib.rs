//! From a scene file to records: scene → world → plan → stepper → record.

pub mod picture;
pub mod record;
pub mod report;
pub mod stepper;
pub mod system;
