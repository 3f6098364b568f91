//! Definitions of IDL: modules, structs, enums, typedefs and constants.

use std::sync::Arc;

use slate_blackboard::interface::Primitive;
use slate_sorted::{SortedMap, SortedSet};

use super::lexer::{Lexer, TokenKind};
use super::scope::{IdlDefinition, Scope};
use super::{IdlEnum, IdlError, IdlKind, IdlMember, IdlStruct, MAX_DEPTH, MAX_MEMBERS, MAX_SIZE, TypeExtent};

/// Annotation, such as `@key` or `@value(3)`.
pub struct Annotation {
    pub name: String,
    pub argument: Option<String>,
}

/// Parses definitions by recursive descent.
pub struct DefinitionParser {
    pub lexer: Lexer,
    pub scope: Scope,
}

impl DefinitionParser {
    pub fn new(lexer: Lexer) -> Self {
        Self { lexer, scope: Scope::default() }
    }

    pub fn parse(mut self) -> Result<SortedMap<String, IdlDefinition>, IdlError> {
        while *self.lexer.peek() != TokenKind::End {
            self.definition()?;
        }
        Ok(self.scope.definitions)
    }

    fn definition(&mut self) -> Result<(), IdlError> {
        let annotations = self.annotations()?;
        let keyword = self.word("a definition")?;
        match keyword.as_str() {
            "module" => return self.module(),
            "struct" => self.structure(&annotations)?,
            "enum" => self.enumeration(&annotations)?,
            "typedef" => self.typedef()?,
            "const" => self.constant()?,
            other => {
                let reason = format!(
                    "`{other}` is not supported: a file has modules, structs, enums, typedefs and constants"
                );
                return Err(self.lexer.error(reason));
            }
        }
        self.symbol(';')
    }

    fn module(&mut self) -> Result<(), IdlError> {
        let name = self.name("a module")?;
        self.symbol('{')?;
        if self.scope.depth() >= MAX_DEPTH {
            return Err(self.lexer.error(format!("modules stand more than {MAX_DEPTH} deep")));
        }
        self.scope.open(&name);
        while !self.is_next('}') {
            self.definition()?;
        }
        self.scope.close();
        self.symbol(';')
    }

    fn structure(&mut self, annotations: &[Annotation]) -> Result<(), IdlError> {
        let name = self.name("a struct")?;
        let place = self.lexer.place();
        let is_appendable = self.extensibility(annotations)?;
        let mut members = if self.is_next(':') { self.base()? } else { Vec::new() };
        if *self.lexer.peek() == TokenKind::Symbol(';') {
            return Err(self.lexer.error(format!("`{name}` is declared without members: define it here")));
        }
        self.symbol('{')?;
        while !self.is_next('}') {
            self.member(&mut members)?;
        }
        let mut names = SortedSet::new();
        if let Some(twice) = members.iter().find(|member| !names.insert(member.name.as_str())) {
            return Err(self.lexer.error(format!("`{name}` has two members `{}`", twice.name)));
        }
        if members.is_empty() {
            return Err(self.lexer.error(format!("`{name}` has no members")));
        }
        let extents = members.iter().map(|member| member.kind.extent());
        let none = TypeExtent { depth: 1, size: 0, members: 0 };
        let extent = extents.fold(none, |all, own| TypeExtent {
            depth: all.depth.max(own.depth + 1),
            size: all.size.saturating_add(own.size),
            members: all.members + own.members,
        });
        self.check_extent(&name, extent)?;
        let whole = self.scope.whole(&name);
        let own = IdlStruct { name: whole, place, is_appendable, members, extent };
        self.define(&name, IdlDefinition::Type(IdlKind::Struct(Arc::new(own))))
    }

    /// Members of the struct that another one extends.
    fn base(&mut self) -> Result<Vec<IdlMember>, IdlError> {
        let name = self.scoped_name()?;
        match self.scope.find(&name) {
            Some(IdlDefinition::Type(IdlKind::Struct(base))) => Ok(base.members.clone()),
            _ => Err(self.lexer.error(format!("`{name}` is not a struct that is defined before"))),
        }
    }

    fn extensibility(&self, annotations: &[Annotation]) -> Result<Option<bool>, IdlError> {
        let mut is_appendable = None;
        for own in annotations {
            let argument = own.argument.as_deref().map(str::to_ascii_lowercase);
            match (own.name.as_str(), argument.as_deref()) {
                ("final", _) | ("extensibility", Some("final")) => is_appendable = Some(false),
                ("appendable", _) | ("extensibility", Some("appendable")) => is_appendable = Some(true),
                ("mutable" | "extensibility", _) => {
                    let reason = "mutable types are not supported: write @final or @appendable";
                    return Err(self.lexer.error(reason));
                }
                _ => {}
            }
        }
        Ok(is_appendable)
    }

    fn enumeration(&mut self, annotations: &[Annotation]) -> Result<(), IdlError> {
        let name = self.name("an enum")?;
        let carrier = match self.number_of(annotations, "bit_bound")? {
            None | Some(17..=32) => Primitive::I32,
            Some(1..=8) => Primitive::I8,
            Some(9..=16) => Primitive::I16,
            Some(other) => {
                return Err(self.lexer.error(format!("@bit_bound is from 1 to 32, found {other}")));
            }
        };
        self.symbol('{')?;
        let (mut values, mut next) = (Vec::<(String, i64)>::new(), 0_i64);
        loop {
            let annotations = self.annotations()?;
            let own = self.name("an enumerator")?;
            let value = self.number_of(&annotations, "value")?.unwrap_or(next);
            let fits = carrier.integers().is_some_and(|range| range.contains(&value.into()));
            if !fits || values.iter().any(|(_, other)| *other == value) {
                let reason = format!("{value} of `{own}` is taken, or does not fit a {}", carrier.name());
                return Err(self.lexer.error(reason));
            }
            next = value.saturating_add(1);
            self.define(&own, IdlDefinition::Enumerator)?;
            values.push((own, value));
            if self.is_next('}') {
                break;
            }
            self.symbol(',')?;
            if self.is_next('}') {
                break;
            }
        }
        let own = IdlEnum { name: self.scope.whole(&name), carrier, values };
        self.define(&name, IdlDefinition::Type(IdlKind::Enumeration(Arc::new(own))))
    }

    fn typedef(&mut self) -> Result<(), IdlError> {
        let kind = self.kind(0)?;
        loop {
            let (name, kind) = self.declarator(kind.clone())?;
            self.check_extent(&name, kind.extent())?;
            self.define(&name, IdlDefinition::Type(kind))?;
            if !self.is_next(',') {
                return Ok(());
            }
        }
    }

    fn constant(&mut self) -> Result<(), IdlError> {
        let kind = self.kind(0)?;
        let name = self.name("a constant")?;
        self.symbol('=')?;
        match kind {
            IdlKind::Primitive(own) if own.integers().is_some() => {
                let value = self.integer()?;
                self.define(&name, IdlDefinition::Constant(value))
            }
            other => {
                let reason = format!("a constant is an integer, found a {}", other.describe());
                Err(self.lexer.error(reason))
            }
        }
    }

    pub fn check_extent(&self, name: &str, extent: TypeExtent) -> Result<(), IdlError> {
        if extent.members > MAX_MEMBERS {
            return Err(self
                .lexer
                .error(format!("`{name}` has more than {MAX_MEMBERS} members with all in it")));
        }
        if extent.depth > MAX_DEPTH {
            return Err(self.lexer.error(format!("types stand more than {MAX_DEPTH} deep in `{name}`")));
        }
        if extent.size > MAX_SIZE {
            return Err(self.lexer.error(format!("`{name}` has more than {MAX_SIZE} bytes")));
        }
        Ok(())
    }

    fn define(&mut self, name: &str, definition: IdlDefinition) -> Result<(), IdlError> {
        match self.scope.define(name, definition) {
            true => Ok(()),
            false => Err(self.lexer.error(format!("`{name}` is defined twice"))),
        }
    }

    /// Returns the number of an annotation, if present.
    fn number_of(&self, annotations: &[Annotation], name: &str) -> Result<Option<i64>, IdlError> {
        let Some(own) = annotations.iter().find(|own| own.name == name) else { return Ok(None) };
        let number = own.argument.as_deref().and_then(|text| text.trim().parse().ok());
        let wrong = || self.lexer.error(format!("@{name} takes a number, as in @{name}(3)"));
        number.map(Some).ok_or_else(wrong)
    }
}
