//! The events of work in Rust for a callback in Python, and Python's Ctrl-C for the work.

use isomorph::{Event, StopFlag};
use pyo3::prelude::*;
use serde_json::Value;

/// What listens while the interpreter is free for other threads.
pub(crate) struct Watch {
    callback: Option<Py<PyAny>>,
    stop: StopFlag,
    /// What the callback raised, or a signal.
    raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(callback: Option<Py<PyAny>>, stop: StopFlag) -> Self {
        Self {
            callback,
            stop,
            raised: None,
        }
    }

    /// Hands an event on, as a JSON object in text, and looks for signals. After the first exception the work is to
    /// stop, and nothing more is called.
    pub(crate) fn hear(&mut self, event: &Event) {
        self.hear_json(|| Some(event.json()));
    }

    /// The same of what is made only if somebody listens, and may be nothing.
    pub(crate) fn hear_json(&mut self, event: impl FnOnce() -> Option<Value>) {
        if self.raised.is_some() {
            return;
        }
        let heard = Python::attach(|py| {
            py.check_signals()?;
            match &self.callback {
                Some(callback) => match event() {
                    Some(event) => callback.call1(py, (event.to_string(),)).map(drop),
                    None => Ok(()),
                },
                None => Ok(()),
            }
        });
        if let Err(raised) = heard {
            self.raised = Some(raised);
            self.stop.set();
        }
    }

    /// What was raised meanwhile comes before how the work ended.
    pub(crate) fn end<T>(self, ended: isomorph::Result<T>) -> PyResult<T> {
        match self.raised {
            Some(raised) => Err(raised),
            None => ended.map_err(crate::failure::raised),
        }
    }
}
