use std::fmt;

use serde::{Serialize, de::DeserializeOwned};
use slate_module::Ports;

use crate::{Acting, ActionRequest, ActionTree, Arguments, Step};

/// Repertoire of a robot's actions: an action of any of its kinds.
/// Made by [`repertoire!`](crate::repertoire).
pub trait Repertoire: Serialize + DeserializeOwned + Send + 'static {
    /// Kind of the Execute block.
    const NAME: &'static str;
    /// Body of the actions.
    type Body: Ports;
    /// Names of the kinds.
    const KINDS: &'static [&'static str];

    /// Creates a requested action, before its first step.
    ///
    /// # Errors
    /// If the kind is unknown or the arguments don't fit.
    fn start(request: &ActionRequest) -> Result<Self, RequestError>;

    /// Renews the arguments.
    ///
    /// # Errors
    /// If it is another kind or the arguments don't fit; without a change.
    fn renew(&mut self, request: &ActionRequest) -> Result<(), RequestError>;

    /// Performs a step.
    fn act(&mut self, acting: &Acting<'_, Self::Body>) -> Step;

    /// Ends an action that was stepped, and is not any more.
    fn cancel(&mut self, acting: &Acting<'_, Self::Body>);

    /// Writes the action and its children.
    fn describe(&self, tree: &mut ActionTree);
}

/// Error of starting an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// The robot has no such action.
    #[error("unknown action; known: {}", List(.known))]
    UnknownKind {
        /// Known kinds.
        known: &'static [&'static str],
    },
    /// Too many or too few arguments.
    #[error("{given} arguments, expected {expected}")]
    Count {
        /// Number of arguments.
        given: usize,
        /// Expected number.
        expected: usize,
    },
    /// An argument is infinite or not a number.
    #[error("an argument is not a finite number")]
    NotFinite,
}

struct List<'a>(&'a &'static [&'static str]);

impl fmt::Display for List<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, name) in self.0.iter().enumerate() {
            write!(f, "{}{name}", if i == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}

/// Returns the arguments of a request, if number and values are valid.
///
/// # Errors
/// If number or values are invalid.
pub fn read_arguments<A: Arguments>(request: &ActionRequest) -> Result<A, RequestError> {
    let given = request.arguments.len();
    if given != A::LENGTH {
        return Err(RequestError::Count { given, expected: A::LENGTH });
    }
    if !request.arguments.iter().all(|number| number.is_finite()) {
        return Err(RequestError::NotFinite);
    }
    Ok(A::read(&request.arguments))
}

/// Defines an enum of all actions that a robot knows, for its Execute.
/// `repertoire! { pub enum PioneerActions for PioneerBody { SetWheelSpeed, TurnAngle } }`.
///
/// With `for PioneerBody as "pioneer_execute"` the Execute's plugin has that name instead of `execute`, for programs
/// with several kinds of robots.
#[macro_export]
macro_rules! repertoire {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $name:ident for $body:ty $(as $plugin:literal)? { $($action:ident),+ $(,)? }
    ) => {
        $(#[$attribute])*
        $visibility enum $name {
            $(#[doc = concat!("The action `", stringify!($action), "`.")] $action($action)),+
        }

        impl $crate::Repertoire for $name {
            const NAME: &'static str = $crate::repertoire!(@name $($plugin)?);
            type Body = $body;
            const KINDS: &'static [&'static str] = &[$(<$action as $crate::ActionKind>::KIND),+];

            fn start(request: &$crate::ActionRequest) -> ::core::result::Result<Self, $crate::RequestError> {
                let kind = request.kind.as_str();
                $(if kind == <$action as $crate::ActionKind>::KIND {
                    return $crate::read_arguments(request)
                        .map(|arguments| Self::$action(<$action as $crate::ActionKind>::start(arguments)));
                })+
                ::core::result::Result::Err($crate::RequestError::UnknownKind { known: Self::KINDS })
            }

            fn renew(&mut self, request: &$crate::ActionRequest) -> ::core::result::Result<(), $crate::RequestError> {
                let kind = request.kind.as_str();
                match self {
                    $(Self::$action(action) if kind == <$action as $crate::ActionKind>::KIND => {
                        $crate::ActionKind::renew(action, $crate::read_arguments(request)?);
                        ::core::result::Result::Ok(())
                    })+
                    _ => ::core::result::Result::Err($crate::RequestError::UnknownKind { known: Self::KINDS }),
                }
            }

            fn act(&mut self, acting: &$crate::Acting<'_, $body>) -> $crate::Step {
                match self {
                    $(Self::$action(action) => $crate::Action::act(action, acting)),+
                }
            }

            fn cancel(&mut self, acting: &$crate::Acting<'_, $body>) {
                match self {
                    $(Self::$action(action) => $crate::Action::cancel(action, acting)),+
                }
            }

            fn describe(&self, tree: &mut $crate::ActionTree) {
                match self {
                    $(Self::$action(action) => $crate::ActionKind::describe(action, tree)),+
                }
            }
        }

        // Written out, so that a program needs serde only through its actions' derives.
        const _: () = {
            use $crate::serde::{Deserialize, Deserializer, Serialize, Serializer, de};

            impl Serialize for $name {
                fn serialize<S: Serializer>(&self, serializer: S) -> ::core::result::Result<S::Ok, S::Error> {
                    match self {
                        $(Self::$action(action) => serializer.serialize_newtype_variant(
                            stringify!($name), 0, <$action as $crate::ActionKind>::KIND, action)),+
                    }
                }
            }

            struct Visitor;

            impl<'de> de::Visitor<'de> for Visitor {
                type Value = $name;

                fn expecting(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                    f.write_str("an action")
                }

                fn visit_enum<A: de::EnumAccess<'de>>(self, data: A) -> ::core::result::Result<$name, A::Error> {
                    let (kind, action) = data.variant::<::std::string::String>()?;
                    $(if kind == <$action as $crate::ActionKind>::KIND {
                        return de::VariantAccess::newtype_variant(action).map($name::$action);
                    })+
                    ::core::result::Result::Err(de::Error::unknown_variant(
                        &kind, <$name as $crate::Repertoire>::KINDS))
                }
            }

            impl<'de> Deserialize<'de> for $name {
                fn deserialize<D: Deserializer<'de>>(deserializer: D) -> ::core::result::Result<Self, D::Error> {
                    deserializer.deserialize_enum(
                        stringify!($name), <$name as $crate::Repertoire>::KINDS, Visitor)
                }
            }
        };
    };
    (@name) => { "execute" };
    (@name $plugin:literal) => { $plugin };
}
