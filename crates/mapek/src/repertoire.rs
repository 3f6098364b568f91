use std::fmt;

use serde::{Serialize, de::DeserializeOwned};
use slate_module::Ports;

use crate::{Acting, ActionRequest, ActionTree, Arguments, Step};

/// All actions that a robot knows, made by [`repertoire!`](crate::repertoire): an action of any of these kinds.
pub trait Repertoire: Serialize + DeserializeOwned + Send + 'static {
    /// The plugin name of the Execute that performs them.
    const NAME: &'static str;
    /// What they act on.
    type Body: Ports;
    /// The names of the kinds.
    const KINDS: &'static [&'static str];

    /// The action that is asked for, before its first step.
    ///
    /// # Errors
    /// When the kind is unknown or the arguments don't fit.
    fn start(request: &ActionRequest) -> Result<Self, RequestError>;

    /// Takes newer arguments.
    ///
    /// # Errors
    /// When it is another kind or the arguments don't fit; nothing changes then.
    fn renew(&mut self, request: &ActionRequest) -> Result<(), RequestError>;

    /// One step.
    fn act(&mut self, acting: &Acting<'_, Self::Body>) -> Step;

    /// Ends an action that was stepped before and will not be any more.
    fn cancel(&mut self, acting: &Acting<'_, Self::Body>);

    /// Writes the action and those inside it.
    fn describe(&self, tree: &mut ActionTree);
}

/// Why an action can't be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// The robot has no such action.
    #[error("unknown action, known are {}", List(.known))]
    UnknownKind {
        /// The kinds that there are.
        known: &'static [&'static str],
    },
    /// Too many or too few arguments.
    #[error("{given} arguments, expected {expected}")]
    Count {
        /// How many there are.
        given: usize,
        /// How many it takes.
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

/// The arguments of a request, if there are as many as the kind takes and all are finite.
///
/// # Errors
/// What is wrong with them.
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

/// Makes an enum of all actions that a robot knows, for its Execute:
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
