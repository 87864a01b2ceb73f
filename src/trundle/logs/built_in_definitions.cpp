#include <array>
#include <string_view>
#include <utility>

#include "trundle/logs/detail/raw_types.hpp"

namespace trundle::logs {
namespace {

/// The fields of the messages that robots record, as ROS 2 Humble has them: its logs of SQLite hold no
/// definitions. Sorted by name.
constexpr std::array<std::pair<std::string_view, std::string_view>, 121> kDefinitions = {{
    {"apriltag_msgs/AprilTagDetection",
     R"(string family
int32 id
int32 hamming
float32 goodness
float32 decision_margin
Point centre
Point[4] corners
float64[9] homography)"},
    {"apriltag_msgs/AprilTagDetectionArray",
     R"(std_msgs/Header header
AprilTagDetection[] detections)"},
    {"apriltag_msgs/Point",
     R"(float64 x
float64 y)"},
    {"builtin_interfaces/Duration",
     R"(int32 sec
uint32 nanosec)"},
    {"builtin_interfaces/Time",
     R"(int32 sec
uint32 nanosec)"},
    {"control_msgs/DynamicJointState",
     R"(std_msgs/Header header
string[] joint_names
InterfaceValue[] interface_values)"},
    {"control_msgs/InterfaceValue",
     R"(string[] interface_names
float64[] values)"},
    {"diagnostic_msgs/DiagnosticArray",
     R"(std_msgs/Header header
DiagnosticStatus[] status)"},
    {"diagnostic_msgs/DiagnosticStatus",
     R"(byte level
string name
string message
string hardware_id
KeyValue[] values)"},
    {"diagnostic_msgs/KeyValue",
     R"(string key
string value)"},
    {"geometry_msgs/Accel",
     R"(Vector3 linear
Vector3 angular)"},
    {"geometry_msgs/AccelStamped",
     R"(std_msgs/Header header
Accel accel)"},
    {"geometry_msgs/AccelWithCovariance",
     R"(Accel accel
float64[36] covariance)"},
    {"geometry_msgs/AccelWithCovarianceStamped",
     R"(std_msgs/Header header
AccelWithCovariance accel)"},
    {"geometry_msgs/Inertia",
     R"(float64 m
Vector3 com
float64 ixx
float64 ixy
float64 ixz
float64 iyy
float64 iyz
float64 izz)"},
    {"geometry_msgs/InertiaStamped",
     R"(std_msgs/Header header
Inertia inertia)"},
    {"geometry_msgs/Point",
     R"(float64 x
float64 y
float64 z)"},
    {"geometry_msgs/Point32",
     R"(float32 x
float32 y
float32 z)"},
    {"geometry_msgs/PointStamped",
     R"(std_msgs/Header header
Point point)"},
    {"geometry_msgs/Polygon", R"(Point32[] points)"},
    {"geometry_msgs/PolygonInstance",
     R"(Polygon polygon
int64 id)"},
    {"geometry_msgs/PolygonInstanceStamped",
     R"(std_msgs/Header header
PolygonInstance polygon)"},
    {"geometry_msgs/PolygonStamped",
     R"(std_msgs/Header header
Polygon polygon)"},
    {"geometry_msgs/Pose",
     R"(Point position
Quaternion orientation)"},
    {"geometry_msgs/Pose2D",
     R"(float64 x
float64 y
float64 theta)"},
    {"geometry_msgs/PoseArray",
     R"(std_msgs/Header header
Pose[] poses)"},
    {"geometry_msgs/PoseStamped",
     R"(std_msgs/Header header
Pose pose)"},
    {"geometry_msgs/PoseWithCovariance",
     R"(Pose pose
float64[36] covariance)"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     R"(std_msgs/Header header
PoseWithCovariance pose)"},
    {"geometry_msgs/Quaternion",
     R"(float64 x 0
float64 y 0
float64 z 0
float64 w 1)"},
    {"geometry_msgs/QuaternionStamped",
     R"(std_msgs/Header header
Quaternion quaternion)"},
    {"geometry_msgs/Transform",
     R"(Vector3 translation
Quaternion rotation)"},
    {"geometry_msgs/TransformStamped",
     R"(std_msgs/Header header
string child_frame_id
Transform transform)"},
    {"geometry_msgs/Twist",
     R"(Vector3 linear
Vector3 angular)"},
    {"geometry_msgs/TwistStamped",
     R"(std_msgs/Header header
Twist twist)"},
    {"geometry_msgs/TwistWithCovariance",
     R"(Twist twist
float64[36] covariance)"},
    {"geometry_msgs/TwistWithCovarianceStamped",
     R"(std_msgs/Header header
TwistWithCovariance twist)"},
    {"geometry_msgs/Vector3",
     R"(float64 x
float64 y
float64 z)"},
    {"geometry_msgs/Vector3Stamped",
     R"(std_msgs/Header header
Vector3 vector)"},
    {"geometry_msgs/VelocityStamped",
     R"(std_msgs/Header header
string body_frame_id
string reference_frame_id
Twist velocity)"},
    {"geometry_msgs/Wrench",
     R"(Vector3 force
Vector3 torque)"},
    {"geometry_msgs/WrenchStamped",
     R"(std_msgs/Header header
Wrench wrench)"},
    {"irobot_create_msgs/WheelTicks",
     R"(std_msgs/Header header
int32 ticks_left
int32 ticks_right)"},
    {"irobot_create_msgs/WheelVels",
     R"(std_msgs/Header header
float32 velocity_left
float32 velocity_right)"},
    {"nav_msgs/Goals",
     R"(std_msgs/Header header
geometry_msgs/PoseStamped[] goals)"},
    {"nav_msgs/GridCells",
     R"(std_msgs/Header header
float32 cell_width
float32 cell_height
geometry_msgs/Point[] cells)"},
    {"nav_msgs/MapMetaData",
     R"(builtin_interfaces/Time map_load_time
float32 resolution
uint32 width
uint32 height
geometry_msgs/Pose origin)"},
    {"nav_msgs/OccupancyGrid",
     R"(std_msgs/Header header
MapMetaData info
int8[] data)"},
    {"nav_msgs/Odometry",
     R"(std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist)"},
    {"nav_msgs/Path",
     R"(std_msgs/Header header
geometry_msgs/PoseStamped[] poses)"},
    {"rcl_interfaces/Log",
     R"(builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line)"},
    {"rcl_interfaces/Parameter",
     R"(string name
ParameterValue value)"},
    {"rcl_interfaces/ParameterEvent",
     R"(builtin_interfaces/Time stamp
string node
Parameter[] new_parameters
Parameter[] changed_parameters
Parameter[] deleted_parameters)"},
    {"rcl_interfaces/ParameterValue",
     R"(uint8 type
bool bool_value
int64 integer_value
float64 double_value
string string_value
byte[] byte_array_value
bool[] bool_array_value
int64[] integer_array_value
float64[] double_array_value
string[] string_array_value)"},
    {"rosgraph_msgs/Clock", R"(builtin_interfaces/Time clock)"},
    {"sensor_msgs/BatteryState",
     R"(std_msgs/Header header
float32 voltage
float32 temperature
float32 current
float32 charge
float32 capacity
float32 design_capacity
float32 percentage
uint8 power_supply_status
uint8 power_supply_health
uint8 power_supply_technology
bool present
float32[] cell_voltage
float32[] cell_temperature
string location
string serial_number)"},
    {"sensor_msgs/CameraInfo",
     R"(std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
RegionOfInterest roi)"},
    {"sensor_msgs/ChannelFloat32",
     R"(string name
float32[] values)"},
    {"sensor_msgs/CompressedImage",
     R"(std_msgs/Header header
string format
uint8[] data)"},
    {"sensor_msgs/FluidPressure",
     R"(std_msgs/Header header
float64 fluid_pressure
float64 variance)"},
    {"sensor_msgs/Illuminance",
     R"(std_msgs/Header header
float64 illuminance
float64 variance)"},
    {"sensor_msgs/Image",
     R"(std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data)"},
    {"sensor_msgs/Imu",
     R"(std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance)"},
    {"sensor_msgs/JointState",
     R"(std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort)"},
    {"sensor_msgs/Joy",
     R"(std_msgs/Header header
float32[] axes
int32[] buttons)"},
    {"sensor_msgs/JoyFeedback",
     R"(uint8 type
uint8 id
float32 intensity)"},
    {"sensor_msgs/JoyFeedbackArray", R"(JoyFeedback[] array)"},
    {"sensor_msgs/LaserEcho", R"(float32[] echoes)"},
    {"sensor_msgs/LaserScan",
     R"(std_msgs/Header header
float32 angle_min
float32 angle_max
float32 angle_increment
float32 time_increment
float32 scan_time
float32 range_min
float32 range_max
float32[] ranges
float32[] intensities)"},
    {"sensor_msgs/MagneticField",
     R"(std_msgs/Header header
geometry_msgs/Vector3 magnetic_field
float64[9] magnetic_field_covariance)"},
    {"sensor_msgs/MultiDOFJointState",
     R"(std_msgs/Header header
string[] joint_names
geometry_msgs/Transform[] transforms
geometry_msgs/Twist[] twist
geometry_msgs/Wrench[] wrench)"},
    {"sensor_msgs/MultiEchoLaserScan",
     R"(std_msgs/Header header
float32 angle_min
float32 angle_max
float32 angle_increment
float32 time_increment
float32 scan_time
float32 range_min
float32 range_max
LaserEcho[] ranges
LaserEcho[] intensities)"},
    {"sensor_msgs/NavSatFix",
     R"(std_msgs/Header header
NavSatStatus status
float64 latitude
float64 longitude
float64 altitude
float64[9] position_covariance
uint8 position_covariance_type)"},
    {"sensor_msgs/NavSatStatus",
     R"(int8 status
uint16 service)"},
    {"sensor_msgs/PointCloud",
     R"(std_msgs/Header header
geometry_msgs/Point32[] points
ChannelFloat32[] channels)"},
    {"sensor_msgs/PointCloud2",
     R"(std_msgs/Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense)"},
    {"sensor_msgs/PointField",
     R"(string name
uint32 offset
uint8 datatype
uint32 count)"},
    {"sensor_msgs/Range",
     R"(std_msgs/Header header
uint8 radiation_type
float32 field_of_view
float32 min_range
float32 max_range
float32 range)"},
    {"sensor_msgs/RegionOfInterest",
     R"(uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify)"},
    {"sensor_msgs/RelativeHumidity",
     R"(std_msgs/Header header
float64 relative_humidity
float64 variance)"},
    {"sensor_msgs/Temperature",
     R"(std_msgs/Header header
float64 temperature
float64 variance)"},
    {"sensor_msgs/TimeReference",
     R"(std_msgs/Header header
builtin_interfaces/Time time_ref
string source)"},
    {"std_msgs/Bool", R"(bool data)"},
    {"std_msgs/Byte", R"(byte data)"},
    {"std_msgs/ByteMultiArray",
     R"(MultiArrayLayout layout
byte[] data)"},
    {"std_msgs/Char", R"(char data)"},
    {"std_msgs/ColorRGBA",
     R"(float32 r
float32 g
float32 b
float32 a)"},
    {"std_msgs/Empty", R"(#)"},
    {"std_msgs/Float32", R"(float32 data)"},
    {"std_msgs/Float32MultiArray",
     R"(MultiArrayLayout layout
float32[] data)"},
    {"std_msgs/Float64", R"(float64 data)"},
    {"std_msgs/Float64MultiArray",
     R"(MultiArrayLayout layout
float64[] data)"},
    {"std_msgs/Header",
     R"(builtin_interfaces/Time stamp
string frame_id)"},
    {"std_msgs/Int16", R"(int16 data)"},
    {"std_msgs/Int16MultiArray",
     R"(MultiArrayLayout layout
int16[] data)"},
    {"std_msgs/Int32", R"(int32 data)"},
    {"std_msgs/Int32MultiArray",
     R"(MultiArrayLayout layout
int32[] data)"},
    {"std_msgs/Int64", R"(int64 data)"},
    {"std_msgs/Int64MultiArray",
     R"(MultiArrayLayout layout
int64[] data)"},
    {"std_msgs/Int8", R"(int8 data)"},
    {"std_msgs/Int8MultiArray",
     R"(MultiArrayLayout layout
int8[] data)"},
    {"std_msgs/MultiArrayDimension",
     R"(string label
uint32 size
uint32 stride)"},
    {"std_msgs/MultiArrayLayout",
     R"(MultiArrayDimension[] dim
uint32 data_offset)"},
    {"std_msgs/String", R"(string data)"},
    {"std_msgs/UInt16", R"(uint16 data)"},
    {"std_msgs/UInt16MultiArray",
     R"(MultiArrayLayout layout
uint16[] data)"},
    {"std_msgs/UInt32", R"(uint32 data)"},
    {"std_msgs/UInt32MultiArray",
     R"(MultiArrayLayout layout
uint32[] data)"},
    {"std_msgs/UInt64", R"(uint64 data)"},
    {"std_msgs/UInt64MultiArray",
     R"(MultiArrayLayout layout
uint64[] data)"},
    {"std_msgs/UInt8", R"(uint8 data)"},
    {"std_msgs/UInt8MultiArray",
     R"(MultiArrayLayout layout
uint8[] data)"},
    {"tf2_msgs/TF2Error",
     R"(uint8 error
string error_string)"},
    {"tf2_msgs/TFMessage", R"(geometry_msgs/TransformStamped[] transforms)"},
    {"trajectory_msgs/JointTrajectory",
     R"(std_msgs/Header header
string[] joint_names
JointTrajectoryPoint[] points)"},
    {"trajectory_msgs/JointTrajectoryPoint",
     R"(float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start)"},
    {"turtlebot3_msgs/SensorState",
     R"(std_msgs/Header header
uint8 bumper
float32 cliff
float32 sonar
float32 illumination
uint8 led
uint8 button
bool torque
int32 left_encoder
int32 right_encoder
float32 battery)"},
    {"visualization_msgs/Marker",
     R"(std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
UVCoordinate[] uv_coordinates
string text
string mesh_resource
MeshFile mesh_file
bool mesh_use_embedded_materials)"},
    {"visualization_msgs/MarkerArray", R"(Marker[] markers)"},
    {"visualization_msgs/MeshFile",
     R"(string filename
uint8[] data)"},
    {"visualization_msgs/UVCoordinate",
     R"(float32 u
float32 v)"},
}};

}  // namespace

std::string_view built_in_definition(std::string_view short_name) {
  for (const auto& [name, definition] : kDefinitions)
    if (name == short_name) return definition;
  return {};
}

}  // namespace trundle::logs
