//! Types of DDS, as files of the OMG's IDL 4.2 define them.
//!
//! Modules, structs (with bases), enums, typedefs and integer constants; sequences, strings and arrays; `#include "FILE"` and
//! include guards; `@key`, `@final`, `@appendable`, `@extensibility`, `@bit_bound` and `@value`. Other annotations that leave the
//! wire alone are skipped; what would change it is an error.

mod definition;
mod error;
mod lexer;
mod members;
mod scope;

use std::path::Path;
use std::sync::Arc;

use slate_blackboard::interface::Primitive;
use slate_sorted::SortedMap;

pub use error::IdlError;

use definition::DefinitionParser;
use lexer::Lexer;
use scope::IdlDefinition;

/// Deepest nesting of types.
const MAX_DEPTH: usize = 32;

/// Most bytes of a value's fixed part.
const MAX_SIZE: usize = 64 << 20;

/// Most members of a type, with those of the structs in it.
const MAX_MEMBERS: usize = 10_000;

/// Size limits of a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TypeExtent {
    /// Nesting of types in it.
    depth: usize,
    /// Fewest bytes of a value, without padding; at least one.
    size: usize,
    /// Members, with those of the structs in it.
    members: usize,
}

/// Type of IDL.
#[derive(Clone, Debug, PartialEq)]
pub enum IdlKind {
    /// Number or truth value; characters and octets are numbers.
    Primitive(Primitive),
    /// Named integer.
    Enumeration(Arc<IdlEnum>),
    /// UTF-8, of at most so many bytes.
    Text(Option<usize>),
    /// Members with names.
    Struct(Arc<IdlStruct>),
    /// Fixed number of items.
    Array(Box<IdlKind>, usize),
    /// List of at most this many items.
    Sequence(Box<IdlKind>, Option<usize>),
}

/// Struct.
#[derive(Debug, PartialEq)]
pub struct IdlStruct {
    /// Name with its modules, such as `demo::Target`.
    pub name: String,
    /// File and line, such as `target.idl:3`.
    pub place: String,
    /// Extensibility: true if later versions may append members.
    /// `None` when the file does not say.
    pub is_appendable: Option<bool>,
    /// Members in their order, those of the base first.
    pub members: Vec<IdlMember>,
    extent: TypeExtent,
}

/// Member of a struct.
#[derive(Clone, Debug, PartialEq)]
pub struct IdlMember {
    /// Name.
    pub name: String,
    /// Type, typedefs resolved.
    pub kind: IdlKind,
    /// Key member, which distinguishes instances.
    pub is_key: bool,
}

/// Enumeration.
#[derive(Debug, PartialEq, Eq)]
pub struct IdlEnum {
    /// Name with its modules.
    pub name: String,
    /// Integer on the wire.
    pub carrier: Primitive,
    /// Names and their values.
    pub values: Vec<(String, i64)>,
}

impl IdlStruct {
    /// Returns whether values belong to instances, which their key distinguishes.
    pub fn has_key(&self) -> bool {
        self.members.iter().any(|member| member.is_key)
    }
}

impl IdlKind {
    /// Returns its name for messages: `long`, `string`, `sequence of demo::Point`.
    pub fn describe(&self) -> String {
        match self {
            Self::Primitive(primitive) => primitive_name(*primitive).into(),
            Self::Enumeration(own) => format!("enum {}", own.name),
            Self::Text(None) => "string".into(),
            Self::Text(Some(bound)) => format!("string of at most {bound} bytes"),
            Self::Struct(own) => format!("struct {}", own.name),
            Self::Array(item, count) => format!("array of {count} x {}", item.describe()),
            Self::Sequence(item, None) => format!("sequence of {}", item.describe()),
            Self::Sequence(item, Some(bound)) => format!("sequence of at most {bound} x {}", item.describe()),
        }
    }

    fn extent(&self) -> TypeExtent {
        let single = |size| TypeExtent { depth: 1, size, members: 1 };
        match self {
            Self::Primitive(primitive) => single(primitive.size()),
            Self::Enumeration(own) => single(own.carrier.size()),
            Self::Text(_) => single(4),
            Self::Struct(own) => own.extent,
            Self::Array(item, count) => {
                let TypeExtent { depth, size, members } = item.extent();
                TypeExtent { depth: depth + 1, size: size.saturating_mul(*count), members }
            }
            Self::Sequence(item, _) => {
                let TypeExtent { depth, members, .. } = item.extent();
                TypeExtent { depth: depth + 1, size: 4, members }
            }
        }
    }
}

/// Returns the name of a primitive in IDL.
fn primitive_name(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "boolean",
        Primitive::U8 => "octet",
        Primitive::I8 => "int8",
        Primitive::U16 => "unsigned short",
        Primitive::I16 => "short",
        Primitive::U32 => "unsigned long",
        Primitive::I32 => "long",
        Primitive::U64 => "unsigned long long",
        Primitive::I64 => "long long",
        Primitive::F32 => "float",
        Primitive::F64 => "double",
    }
}

/// Definitions of a file, and of those that it includes.
///
/// ```
/// use slate_dds::IdlFile;
///
/// let text = "module demo { struct Target { @key long id; double x, y; }; };";
/// let file = IdlFile::parse("target.idl", text)?;
/// let target = file.structure("demo::Target").ok_or("no such struct")?;
/// assert!(target.has_key() && target.members.len() == 3);
/// let error = IdlFile::parse("target.idl", "struct Target {\n  any value;\n};").err();
/// assert_eq!(error.map(|error| error.line), Some(2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct IdlFile {
    definitions: SortedMap<String, IdlDefinition>,
}

impl IdlFile {
    /// Reads a file.
    ///
    /// # Errors
    /// It is not readable, or has what IDL or this reader does not allow, with file and line.
    pub fn read(path: &Path) -> Result<Self, IdlError> {
        let mut lexer = Lexer::of_files();
        lexer.read(path)?;
        Self::of(lexer)
    }

    /// Reads a text; `name` is that of its file in errors. It includes no other.
    ///
    /// # Errors
    /// As [`read`](IdlFile::read).
    pub fn parse(name: &str, text: &str) -> Result<Self, IdlError> {
        let mut lexer = Lexer::of_text();
        lexer.add(name, text)?;
        Self::of(lexer)
    }

    fn of(lexer: Lexer) -> Result<Self, IdlError> {
        Ok(Self { definitions: DefinitionParser::new(lexer).parse()? })
    }

    /// Returns the struct of a name with its modules, such as `demo::Target`.
    pub fn structure(&self, name: &str) -> Option<Arc<IdlStruct>> {
        match self.definitions.get(name)? {
            IdlDefinition::Type(IdlKind::Struct(own)) => Some(Arc::clone(own)),
            _ => None,
        }
    }

    /// Names of the structs, in order.
    pub fn structures(&self) -> impl Iterator<Item = &str> {
        let is_struct = |(name, own): &(&String, &IdlDefinition)| matches!(own, IdlDefinition::Type(IdlKind::Struct(s)) if s.name == **name);
        self.definitions.iter().filter(is_struct).map(|(name, _)| name.as_str())
    }
}
