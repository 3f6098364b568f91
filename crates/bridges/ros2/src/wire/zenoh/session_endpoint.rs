use zenoh::{Result, Session};

/// An endpoint, which is there for others once it is declared at the session.
pub trait SessionEndpoint: Send + Sync {
    /// Declares it.
    ///
    /// # Errors
    /// When Zenoh refuses.
    fn declare(&self, session: &Session) -> Result<()>;
}
