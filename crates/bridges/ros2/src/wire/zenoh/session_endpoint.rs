use zenoh::{Result, Session};

/// Endpoint, visible to others once it is declared at the session.
pub trait SessionEndpoint: Send + Sync {
    /// Declares it.
    ///
    /// # Errors
    /// When Zenoh refuses.
    fn declare(&self, session: &Session) -> Result<()>;
}
