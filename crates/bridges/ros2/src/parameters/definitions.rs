//! Services and messages of `rcl_interfaces`.

use slate_ros_messages::WireFormat;
use slate_topics::ServiceType;

/// Services: name in the node, type and function.
pub const SERVICES: [(&str, &str, ParameterService); 6] = [
    ("get_parameters", "GetParameters", ParameterService::Get),
    ("get_parameter_types", "GetParameterTypes", ParameterService::Types),
    ("set_parameters", "SetParameters", ParameterService::Set),
    ("set_parameters_atomically", "SetParametersAtomically", ParameterService::SetAtomically),
    ("describe_parameters", "DescribeParameters", ParameterService::Describe),
    ("list_parameters", "ListParameters", ParameterService::List),
];

/// Operation of a parameter service.
#[derive(Clone, Copy, Debug)]
pub enum ParameterService {
    Get,
    Types,
    Set,
    SetAtomically,
    Describe,
    List,
}

/// Request, `---` and response.
const DEFINITIONS: [(&str, &str); 6] = [
    ("GetParameters", "string[] names\n---\nParameterValue[] values"),
    ("GetParameterTypes", "string[] names\n---\nuint8[] types"),
    ("SetParameters", "Parameter[] parameters\n---\nSetParametersResult[] results"),
    ("SetParametersAtomically", "Parameter[] parameters\n---\nSetParametersResult result"),
    ("DescribeParameters", "string[] names\n---\nParameterDescriptor[] descriptors"),
    ("ListParameters", "string[] prefixes\nuint64 depth\n---\nListParametersResult result"),
];

/// Messages in them.
pub const MESSAGES: &str = "\
====
MSG: rcl_interfaces/Parameter
string name
ParameterValue value
====
MSG: rcl_interfaces/ParameterValue
uint8 type
bool bool_value
int64 integer_value
float64 double_value
string string_value
byte[] byte_array_value
bool[] bool_array_value
int64[] integer_array_value
float64[] double_array_value
string[] string_array_value
====
MSG: rcl_interfaces/SetParametersResult
bool successful
string reason
====
MSG: rcl_interfaces/ParameterDescriptor
string name
uint8 type
string description
string additional_constraints
bool read_only
bool dynamic_typing
FloatingPointRange[<=1] floating_point_range
IntegerRange[<=1] integer_range
====
MSG: rcl_interfaces/FloatingPointRange
float64 from_value
float64 to_value
float64 step
====
MSG: rcl_interfaces/IntegerRange
int64 from_value
int64 to_value
uint64 step
====
MSG: rcl_interfaces/ListParametersResult
string[] names
string[] prefixes
";

/// Returns the type of a service of parameters.
///
/// # Errors
/// The kind is unknown.
pub fn service_type(kind: &str) -> Result<ServiceType, String> {
    let found = DEFINITIONS.iter().find(|(known, _)| *known == kind);
    let (_, definition) = found.ok_or_else(|| "it is not a service of parameters".to_owned())?;
    let text = format!("{definition}\n{MESSAGES}");
    ServiceType::parse(WireFormat::Cdr, &format!("rcl_interfaces/srv/{kind}"), &text)
}
