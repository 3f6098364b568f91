//! Tables of C calls of the host.

/// Defines a table of C calls with their context, and its constructor.
///
/// The fields are private and the table can't be cloned, so only its maker answers for the calls, and a module that
/// borrows it can't keep it. Each call has the context as its first argument, which the list leaves out.
macro_rules! call_table {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident {
            $($(#[doc = $doc:literal])+ fn $call:ident($($argument:ty),* $(,)?) $(-> $result:ty)?;)+
        }
    ) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Debug)]
        pub struct $name {
            /// Context, passed to each call.
            context: *mut (),
            $($(#[doc = $doc])+ $call: unsafe extern "C" fn(*mut (), $($argument),*) $(-> $result)?,)+
        }

        impl $name {
            /// Returns the table of these calls, for a host.
            ///
            /// Each call receives the context first:
            $(#[doc = concat!("- `", stringify!($call), "`:" $(, $doc, "\n ")+)])+
            ///
            /// # Safety
            /// As long as the table exists, each call acts as described with this context, in any thread that has the
            /// table. Its pointers are used during the call only, and no call unwinds.
            #[allow(clippy::too_many_arguments, reason = "one for each call")]
            pub const unsafe fn new(
                context: *mut (),
                $($call: unsafe extern "C" fn(*mut (), $($argument),*) $(-> $result)?,)+
            ) -> Self {
                Self { context, $($call,)+ }
            }

            /// Returns the layout: size and alignment, and the calls in order.
            #[cfg(test)]
            pub(super) fn layout() -> String {
                let mut layout = format!("{} bytes, aligned to {}\n", size_of::<Self>(), align_of::<Self>());
                $({
                    let arguments: &[&str] = &[$(stringify!($argument)),*];
                    let result: &[&str] = &[$(concat!("-> ", stringify!($result)))?];
                    let (name, arguments, result) = (stringify!($call), arguments.join(", "), result.concat());
                    layout += &format!("  {name}({arguments}) {result}").trim_end();
                    layout.push('\n');
                })+
                layout
            }
        }
    };
}

pub(super) use call_table;
