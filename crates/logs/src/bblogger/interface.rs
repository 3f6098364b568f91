//! Fields of the interfaces of Fawkes, and their layout in memory.

use slate_ros_messages::{CdrWriter, Definition};

/// The interfaces of Fawkes that occur in logs.
/// Each begins with the time of its value, as two numbers of 64 bits. Enumerations are numbers of 32 bits.
const INTERFACES: &[(&str, &str)] = &[
    (
        "BatteryInterface",
        "uint32 current, uint32 voltage, uint32 temperature, float32 absolute_soc, float32 relative_soc",
    ),
    ("GripperInterface", "int32 gripper_state"),
    (
        "IMUInterface",
        "string[32] frame, float32[4] orientation, float64[9] orientation_covariance, float32[3] angular_velocity, \
         float64[9] angular_velocity_covariance, float32[3] linear_acceleration, \
         float64[9] linear_acceleration_covariance",
    ),
    ("JointInterface", "float32 position, float32 velocity"),
    (
        "JoystickInterface",
        "uint8 num_axes, uint8 num_buttons, uint8 supported_ff_effects, uint32 pressed_buttons, float32[8] axis, \
         uint8 ff_effects",
    ),
    (
        "KeyValueInterface",
        "string[32] key, int32 value_type, string[32] value_string, uint32 value_uint, int32 value_int, \
         bool value_bool, uint8 value_byte, float32 value_float",
    ),
    ("Laser1080Interface", "string[32] frame, float32[1080] distances, bool clockwise_angle"),
    ("Laser360Interface", "string[32] frame, float32[360] distances, bool clockwise_angle"),
    ("Laser720Interface", "string[32] frame, float32[720] distances, bool clockwise_angle"),
    (
        "LaserLineInterface",
        "string[32] frame_id, int32 visibility_history, float32[3] point_on_line, float32[3] line_direction, \
         float32 bearing, float32[3] end_point_1, float32[3] end_point_2, float32 length, \
         string[32] end_point_frame_1, string[32] end_point_frame_2",
    ),
    ("LedInterface", "float32 intensity"),
    ("LocalizationInterface", "string[64] map"),
    (
        "MotorInterface",
        "uint32 motor_state, uint32 drive_mode, int32 right_rpm, int32 rear_rpm, int32 left_rpm, \
         float32 odometry_path_length, float32 odometry_position_x, float32 odometry_position_y, \
         float32 odometry_orientation, float32 vx, float32 vy, float32 omega, float32 des_vx, float32 des_vy, \
         float32 des_omega, uint32 controller, string[64] controller_thread_name",
    ),
    (
        "NavigatorInterface",
        "uint32 flags, float32 x, float32 y, float32 dest_x, float32 dest_y, float32 dest_ori, float32 dest_dist, \
         uint32 msgid, bool final, uint32 error_code, float32 max_velocity, float32 max_rotation, \
         float32 security_distance, bool escaping_enabled, int32 drive_mode, bool auto_drive_mode, \
         bool stop_at_target, int32 orientation_mode, string[64] target_frame",
    ),
    (
        "ObjectPositionInterface",
        "uint32 object_type, uint32 flags, bool visible, int32 visibility_history, float32 roll, float32 pitch, \
         float32 yaw, float32 distance, float32 bearing, float32 slope, float32[9] dbs_covariance, float32 world_x, \
         float32 world_y, float32 world_z, float32[9] world_xyz_covariance, float32 relative_x, float32 relative_y, \
         float32 relative_z, float32[9] relative_xyz_covariance, float32 extent_x, float32 extent_y, \
         float32 extent_z, float32 world_x_velocity, float32 world_y_velocity, float32 world_z_velocity, \
         float32[9] world_xyz_velocity_covariance, float32 relative_x_velocity, float32 relative_y_velocity, \
         float32 relative_z_velocity, float32[9] relative_xyz_velocity_covariance",
    ),
    (
        "PanTiltInterface",
        "uint32 flags, float32 pan, float32 tilt, uint32 msgid, bool final, uint32 error_code, bool enabled, \
         bool calibrated, float32 min_pan, float32 max_pan, float32 min_tilt, float32 max_tilt, \
         float32 max_pan_velocity, float32 max_tilt_velocity, float32 pan_velocity, float32 tilt_velocity, \
         float32 pan_margin, float32 tilt_margin",
    ),
    (
        "Position3DInterface",
        "string[32] frame, int32 visibility_history, float64[4] rotation, float64[3] translation, \
         float64[36] covariance",
    ),
    (
        "RobotinoSensorInterface",
        "float32[3] mot_velocity, int32[3] mot_position, float32[3] mot_current, bool bumper, float32[9] distance, \
         bool[8] digital_in, bool[8] digital_out, float32[8] analog_in, bool bumper_estop_enabled",
    ),
    (
        "SkillerInterface",
        "string[1024] skill_string, string[128] error, string[37] exclusive_controller, uint32 msgid, int32 status",
    ),
    ("SpeechRecognitionInterface", "string[1024] text, uint32 counter, bool processing, bool enabled"),
    ("SpeechSynthInterface", "string[1024] text, uint32 msgid, bool final, float32 duration"),
    (
        "SwitchInterface",
        "bool enabled, float32 value, float32 history, uint32 short_activations, uint32 long_activations, \
         uint32 activation_count",
    ),
    (
        "TransformInterface",
        "string[64] frame, string[64] child_frame, bool static_transform, float64[3] translation, \
         float64[4] rotation",
    ),
];

/// Offsets of the fields of an interface.
pub(super) struct Layout {
    fields: Vec<Field>,
}

struct Field {
    name: &'static str,
    of: &'static str,
    /// Number of elements; for a text, of its bytes.
    count: Option<usize>,
    /// Bytes of one.
    size: usize,
    offset: usize,
}

/// A value in memory.
pub(super) struct Values<'a> {
    pub data: &'a [u8],
    pub is_big: bool,
}

impl Values<'_> {
    /// Returns a number's bytes, little end first.
    fn little(&self, offset: usize, size: usize) -> [u8; 8] {
        let mut bytes = [0; 8];
        // A layout fits its data.
        let found = self.data.get(offset..offset + size).unwrap_or_default();
        bytes[..found.len()].copy_from_slice(found);
        if self.is_big {
            bytes[..size].reverse();
        }
        bytes
    }
}

impl Layout {
    /// Returns the layout of that interface with that size in bytes, if it is known.
    /// The layout is that of today's compilers, or the earlier one in which nothing is aligned to more than four bytes.
    pub fn of(interface: &str, bytes: usize) -> Option<Self> {
        let (_, text) = INTERFACES.iter().find(|(name, _)| *name == interface)?;
        [8, 4]
            .into_iter()
            .map(|most| Self::aligned(text, most))
            .find(|(_, size)| *size == bytes)
            .map(|(own, _)| own)
    }

    fn aligned(text: &'static str, most: usize) -> (Self, usize) {
        let (mut fields, mut offset) = (Vec::new(), 16);
        for (of, name) in text.split(", ").filter_map(|field| field.split_once(' ')) {
            let (of, count) = match of.strip_suffix(']').and_then(|of| of.split_once('[')) {
                Some((of, count)) => (of, count.parse().ok()),
                None => (of, None),
            };
            let size = match of {
                "float64" => 8,
                "uint32" | "int32" | "float32" => 4,
                _ => 1,
            };
            offset = usize::next_multiple_of(offset, size.min(most));
            fields.push(Field { name, of, count, size, offset });
            offset += size * count.unwrap_or(1);
        }
        (Self { fields }, offset.next_multiple_of(most))
    }

    pub fn definition(&self, interface: &str) -> Definition {
        let mut text = String::from("# When it was so.\nint64 timestamp_sec\nint64 timestamp_usec\n");
        for Field { name, of, count, .. } in &self.fields {
            match count {
                Some(count) if *of != "string" => text.push_str(&format!("{of}[{count}] {name}\n")),
                _ => text.push_str(&format!("{of} {name}\n")),
            }
        }
        Definition { name: format!("fawkes_msgs/msg/{interface}"), text }
    }

    /// Appends a value as CDR.
    pub fn encode(&self, values: &Values<'_>, out: &mut Vec<u8>) -> Result<(), String> {
        let mut out = CdrWriter::new(out);
        for offset in [0, 8] {
            out.little(&values.little(offset, 8), 8);
        }
        for field in &self.fields {
            let Field { of, count, size, offset, .. } = field;
            if *of == "string" {
                out.text(&self.string(values, field)).map_err(|error| error.to_string())?;
                continue;
            }
            for i in 0..count.unwrap_or(1) {
                let bytes = values.little(offset + i * size, *size);
                match *of {
                    "bool" => out.byte(u8::from(bytes[0] != 0)),
                    _ => out.little(&bytes[..*size], *size),
                }
            }
        }
        Ok(())
    }

    /// Returns a text up to its end.
    /// Bytes that are not UTF-8 are replaced.
    fn string(&self, values: &Values<'_>, field: &Field) -> String {
        let bytes =
            values.data.get(field.offset..field.offset + field.count.unwrap_or(0)).unwrap_or_default();
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        String::from_utf8_lossy(&bytes[..end]).into_owned()
    }

    fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    pub fn text(&self, values: &Values<'_>, name: &str) -> String {
        let field = self.field(name).filter(|field| field.of == "string");
        field.map_or_else(String::new, |field| self.string(values, field))
    }

    /// Returns the numbers of a field; none if there is no such field.
    pub fn numbers(&self, values: &Values<'_>, name: &str) -> Vec<f64> {
        let Some(field) = self.field(name) else { return Vec::new() };
        let number = |i: usize| {
            let bytes = values.little(field.offset + i * field.size, field.size);
            let [a, b, c, d, ..] = bytes;
            match field.of {
                "float64" => f64::from_le_bytes(bytes),
                "float32" => f32::from_le_bytes([a, b, c, d]).into(),
                "int32" => i32::from_le_bytes([a, b, c, d]).into(),
                "uint32" => u32::from_le_bytes([a, b, c, d]).into(),
                _ => a.into(),
            }
        };
        (0..field.count.unwrap_or(1)).map(number).collect()
    }
}
