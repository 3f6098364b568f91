//! The OpenAPI document, which has what each operation of the table accepts.

use slate_control::operations::OPERATIONS;

use super::*;

#[test]
fn document_lists_the_token_where_it_is_accepted() {
    let (_agent, server, _client) = open("token");
    let document = Raw::connect(&server).ask("GET", "/openapi.json", "").1;
    let scheme = &document["components"]["securitySchemes"]["query_token"];
    assert_eq!([&scheme["type"], &scheme["in"], &scheme["name"]], ["apiKey", "query", "token"]);
    for operation in OPERATIONS {
        let method = operation.method.to_ascii_lowercase();
        let entry = &document["paths"][format!("/api/v1{}", operation.path)][&method];
        assert_eq!(entry["operationId"], operation.name);
        let schemes = entry.get("security").unwrap_or(&document["security"]).as_array().unwrap();
        let is_listed = schemes.iter().any(|scheme| scheme.get("query_token").is_some());
        let is_accepted = operation.parameters().any(|parameter| parameter.name == "token");
        assert_eq!((is_listed, is_accepted), (method == "get", method == "get"), "{}", operation.name);
    }
}

#[test]
fn own_parameters_are_accepted_beside_the_token() {
    let (_agent, server, _client) = open("beside");
    for path in ["/agent", "/trace", "/properties?pattern=teller/**", "/log?after=0", "/settings"] {
        let separator = if path.contains('?') { '&' } else { '?' };
        let (status, answer) = Raw::connect(&server).ask("GET", &format!("{path}{separator}token=x"), "");
        assert_ne!(status, 400, "{path}: {answer}");
    }
    let (status, answer) = Raw::connect(&server).ask("DELETE", "/trace?token=x", "");
    assert_eq!(status, 400, "{answer}");
}
