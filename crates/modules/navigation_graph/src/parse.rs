//! Reading of graphs.

use std::fs;
use std::path::Path;
use std::str::FromStr;

use saphyr::{MarkedYaml, Scalar, YamlData, YamlLoader};
use saphyr_parser::{Event, Parser};

use crate::error::{GraphError, GraphFileError};
use crate::graph::{NavigationEdge, NavigationGraph, NavigationNode, Properties};
use crate::insert::Crossing;

/// Largest size of a file, bytes.
const MAX_BYTES: u64 = 4 << 20;
/// Largest depth of lists and maps in each other; a graph has five.
const MAX_DEPTH: usize = 16;

/// Reads a graph from a file.
///
/// # Errors
/// The file can't be read, or is not what Fawkes's navgraph has; the error names file, line and what was expected.
pub fn read_graph(file: &Path) -> Result<NavigationGraph, GraphFileError> {
    let named = |error: GraphFileError| GraphFileError { file: Some(file.into()), ..error };
    let unreadable = |error: std::io::Error| named(GraphFileError::new(format!("can't be read: {error}")));
    let length = fs::metadata(file).map_err(unreadable)?.len();
    if length > MAX_BYTES {
        return Err(named(GraphFileError::new(format!("{length} bytes: expected at most {MAX_BYTES}"))));
    }
    fs::read_to_string(file).map_err(unreadable)?.parse().map_err(named)
}

impl FromStr for NavigationGraph {
    type Err = GraphFileError;

    fn from_str(text: &str) -> Result<Self, GraphFileError> {
        check_depth(text)?;
        let mut parser = Parser::new_from_str(text);
        let mut loader = YamlLoader::<MarkedYaml<'_>>::default();
        // Values of properties stay as they are written.
        loader.early_parse(false);
        parser.load(&mut loader, false).map_err(|error| {
            GraphFileError::at(error.marker().line(), format!("no YAML: {}", error.info()))
        })?;
        let documents = loader.into_documents();
        let document = documents.first().ok_or_else(|| GraphFileError::new("empty: expected a graph"))?;
        let mut graph = Self::new(text_of(field(document, "graph-name")?)?);
        if let Some(properties) = optional(document, "default-properties") {
            graph.default_properties = properties_of(properties)?;
        }
        let mut to_connect = Vec::new();
        for item in items(field(document, "nodes")?)? {
            let node = node_of(item)?;
            to_connect.push((line(item), node.name.clone(), node.properties.get("insert-mode").cloned()));
            graph.add_node(node).map_err(|error| at(item, error))?;
        }
        for item in optional(document, "connections").map(items).transpose()?.unwrap_or_default() {
            let (connection, crossing) = connection_of(item)?;
            graph.connect(connection, crossing).map_err(|error| at(item, error))?;
        }
        for (line, name, mode) in to_connect {
            insert(&mut graph, &name, mode.as_deref()).map_err(|error| GraphFileError::at(line, error.0))?;
        }
        Ok(graph)
    }
}

/// Refuses nesting so deep that reading it would overflow the stack.
fn check_depth(text: &str) -> Result<(), GraphFileError> {
    let mut depth = 0;
    for event in Parser::new_from_str(text) {
        // The loader reports the defect.
        let Ok((event, span)) = event else { return Ok(()) };
        match event {
            Event::SequenceStart(..) | Event::MappingStart(..) => depth += 1,
            Event::SequenceEnd | Event::MappingEnd => depth -= 1,
            _ => {}
        }
        if depth > MAX_DEPTH {
            let reason = format!("more than {MAX_DEPTH} lists and maps in each other: expected a graph");
            return Err(GraphFileError::at(span.start.line(), reason));
        }
    }
    Ok(())
}

/// Connects a node by its property `insert-mode`.
fn insert(graph: &mut NavigationGraph, name: &str, mode: Option<&str>) -> Result<(), GraphError> {
    match mode.map(|mode| mode.to_lowercase().replace('_', "-")).as_deref() {
        None | Some("not-connected") => Ok(()),
        Some("closest-node") => graph.connect_to_nearest_node(name),
        Some("closest-edge") => graph.connect_to_nearest_connection(name),
        Some("closest-edge-or-node") => {
            graph.connect_to_nearest_connection(name).or_else(|_| graph.connect_to_nearest_node(name))
        }
        Some("unconnected") => {
            if let Some(node) = graph.nodes.get_mut(name) {
                node.is_unconnected = true;
            }
            Ok(())
        }
        Some(other) => Err(GraphError(format!(
            "insert-mode `{other}`: expected closest-node, closest-edge, closest-edge-or-node, unconnected or \
             not-connected"
        ))),
    }
}

fn node_of(item: &MarkedYaml<'_>) -> Result<NavigationNode, GraphFileError> {
    let position = field(item, "pos")?;
    let numbers: Vec<f64> = items(position)?
        .iter()
        .map(|number| {
            let text = text_of(number)?;
            text.parse()
                .map_err(|_| GraphFileError::at(line(number), format!("`{text}`: expected a number, m")))
        })
        .collect::<Result<_, _>>()?;
    let &[x, y] = &numbers[..] else {
        return Err(GraphFileError::at(
            line(position),
            format!("{} numbers: expected pos: [x, y]", numbers.len()),
        ));
    };
    Ok(NavigationNode {
        name: text_of(field(item, "name")?)?,
        position: [x, y],
        is_unconnected: tag(item).is_some_and(|tag| tag == "unconnected"),
        properties: optional(item, "properties").map(properties_of).transpose()?.unwrap_or_default(),
    })
}

fn connection_of(item: &MarkedYaml<'_>) -> Result<(NavigationEdge, Crossing), GraphFileError> {
    let ends = items(item)?.iter().map(text_of).collect::<Result<Vec<_>, _>>()?;
    let [from, to] = <[String; 2]>::try_from(ends).map_err(|ends| {
        GraphFileError::at(line(item), format!("{} names: expected a connection [from, to]", ends.len()))
    })?;
    let (is_directed, crossing) = match tag(item).as_deref() {
        None | Some("no-intersection") => (false, Crossing::Refuse),
        // A single tag can't define the treatment of a crossing.
        Some("dir") => (true, Crossing::Allow),
        Some("allow-intersection") => (false, Crossing::Allow),
        Some("split-intersection") => (false, Crossing::Split),
        Some(other) => {
            let expected = "expected !dir, !no-intersection, !allow-intersection or !split-intersection";
            return Err(GraphFileError::at(line(item), format!("tag `!{other}`: {expected}")));
        }
    };
    Ok((NavigationEdge { from, to, is_directed }, crossing))
}

/// Returns a list of names, which are true, and of maps.
fn properties_of(list: &MarkedYaml<'_>) -> Result<Properties, GraphFileError> {
    let mut properties = Properties::new();
    for item in items(list)? {
        if let YamlData::Mapping(map) = &item.data {
            for (key, value) in map {
                properties.insert(text_of(key)?, text_of(value)?);
            }
        } else {
            properties.insert(text_of(item)?, "true".into());
        }
    }
    Ok(properties)
}

fn field<'a, 'text>(map: &'a MarkedYaml<'text>, name: &str) -> Result<&'a MarkedYaml<'text>, GraphFileError> {
    optional(map, name).ok_or_else(|| GraphFileError::at(line(map), format!("`{name}` is missing")))
}

fn optional<'a, 'text>(map: &'a MarkedYaml<'text>, name: &str) -> Option<&'a MarkedYaml<'text>> {
    match &inner(map).data {
        YamlData::Mapping(map) => {
            map.iter().find(|(key, _)| text_of(key).is_ok_and(|key| key == name)).map(|(_, value)| value)
        }
        _ => None,
    }
}

fn items<'a, 'text>(list: &'a MarkedYaml<'text>) -> Result<&'a [MarkedYaml<'text>], GraphFileError> {
    match &inner(list).data {
        YamlData::Sequence(items) => Ok(items),
        _ => Err(GraphFileError::at(line(list), "expected a list")),
    }
}

fn text_of(node: &MarkedYaml<'_>) -> Result<String, GraphFileError> {
    match &inner(node).data {
        YamlData::Representation(text, ..) => Ok(text.to_string()),
        YamlData::Value(Scalar::String(text)) => Ok(text.to_string()),
        _ => Err(GraphFileError::at(line(node), "expected a text or a number")),
    }
}

/// Returns a node without its tag.
fn inner<'a, 'text>(node: &'a MarkedYaml<'text>) -> &'a MarkedYaml<'text> {
    match &node.data {
        YamlData::Tagged(_, inner) => inner,
        _ => node,
    }
}

fn tag(node: &MarkedYaml<'_>) -> Option<String> {
    match &node.data {
        YamlData::Tagged(tag, _) => Some(tag.suffix.rsplit('/').next().unwrap_or_default().to_owned()),
        _ => None,
    }
}

fn line(node: &MarkedYaml<'_>) -> usize {
    node.span.start.line()
}

fn at(node: &MarkedYaml<'_>, error: GraphError) -> GraphFileError {
    GraphFileError::at(line(node), error.0)
}
