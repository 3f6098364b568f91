//! Threads that wait for agents, so that Python's own threads can be interrupted.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use slate_control::Client;

/// Time after which a waiting call looks for signals, such as Ctrl-C.
const SIGNALS: Duration = Duration::from_millis(50);

/// Answer of an agent as JSON text, or the error.
pub type Answer = Result<String, slate_control::ClientError>;

/// Request that a worker carries out.
pub type Job = Box<dyn FnOnce(&mut Client) -> Answer + Send>;

/// Thread with a connection to an agent.
pub struct Worker {
    jobs: Sender<Job>,
    /// Only the call that has the worker listens.
    answers: Mutex<Receiver<Answer>>,
}

impl Worker {
    /// Starts the thread.
    /// It ends when this is dropped and its last request has returned.
    pub fn start(mut client: Client) -> std::io::Result<Self> {
        let (jobs, taken) = channel::<Job>();
        let (given, answers) = channel();
        thread::Builder::new().name("slate-client".into()).spawn(move || {
            while let Ok(job) = taken.recv() {
                if given.send(job(&mut client)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, answers: Mutex::new(answers) })
    }

    /// Carries out a request without the GIL.
    ///
    /// After an error the worker is of no use: its thread may still wait for the agent.
    ///
    /// # Errors
    /// The exception of a signal handler, such as `KeyboardInterrupt`.
    pub fn call(&self, py: Python<'_>, job: Job) -> PyResult<Option<Answer>> {
        if self.jobs.send(job).is_err() {
            return Ok(None);
        }
        loop {
            match py.detach(|| self.wait()) {
                Ok(answer) => return Ok(Some(answer)),
                Err(RecvTimeoutError::Timeout) => py.check_signals()?,
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }

    fn wait(&self) -> Result<Answer, RecvTimeoutError> {
        self.answers.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(SIGNALS)
    }
}
