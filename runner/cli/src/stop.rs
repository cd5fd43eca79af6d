//! Ctrl-C and termination: finish the step, write a checkpoint, leave.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Arms the signals and returns the flag the run looks at. A second signal ends the program at once.
pub fn arm() -> &'static AtomicBool {
    // failing to arm only means that Ctrl-C ends the program as it always does
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    &STOP
}

/// Raises the flag when standard input ends, which is when the process that holds its other end is gone.
pub fn when_input_ends() {
    std::thread::spawn(|| {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        STOP.store(true, Ordering::Relaxed);
    });
}
