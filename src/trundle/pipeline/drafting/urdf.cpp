#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {
namespace {

/// A start or end of an element, as URDF needs it: no text between elements has a meaning there.
struct XmlTag {
  std::string_view name;
  std::map<std::string_view, std::string_view> attributes;
  bool is_end = false;    ///< </name>
  bool is_empty = false;  ///< <name/>
  std::size_t line = 0;
};

class XmlTags {
 public:
  XmlTags(std::string_view text, std::string file) : rest_(text), file_(std::move(file)) {}

  /// Nothing at the end. Throws InputError where a tag is not closed.
  std::optional<XmlTag> next() {
    while (true) {
      const std::size_t open = rest_.find('<');
      if (open == std::string_view::npos) return std::nullopt;
      pass(open);
      if (pass_between("<!--", "-->") || pass_between("<?", "?>") || pass_between("<![CDATA[", "]]>") ||
          pass_between("<!", ">"))
        continue;
      return tag();
    }
  }

 private:
  void pass(std::size_t count) {
    line_ += static_cast<std::size_t>(
        std::count(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(count), '\n'));
    rest_.remove_prefix(count);
  }
  bool pass_between(std::string_view begin, std::string_view end) {
    if (!rest_.starts_with(begin)) return false;
    const std::size_t close = rest_.find(end, begin.size());
    if (close == std::string_view::npos) fail();
    pass(close + end.size());
    return true;
  }
  [[noreturn]] void fail() const { throw InputError(place(file_, line_), "an element is not closed", "XML"); }
  XmlTag tag() {
    XmlTag tag{.name = {}, .attributes = {}, .line = line_};
    pass(1);
    if (rest_.starts_with('/')) {
      tag.is_end = true;
      pass(1);
    }
    tag.name = word();
    while (true) {
      pass(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
      if (rest_.empty()) fail();
      if (rest_.starts_with('>')) break;
      if (rest_.starts_with("/>")) {
        tag.is_empty = true;
        pass(1);
        break;
      }
      attribute(tag);
    }
    pass(1);
    return tag;
  }
  std::string_view word() {
    const std::size_t end = std::min(rest_.find_first_of(" \t\r\n/>=<\"'"), rest_.size());
    const std::string_view found = rest_.substr(0, end);
    pass(end);
    return found;
  }
  void attribute(XmlTag& tag) {
    const std::string_view name = word();
    pass(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    if (name.empty() || !rest_.starts_with('=')) fail();
    pass(1);
    pass(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    if (rest_.empty() || (rest_[0] != '"' && rest_[0] != '\'')) fail();
    const std::size_t close = rest_.find(rest_[0], 1);
    if (close == std::string_view::npos) fail();
    tag.attributes[name] = rest_.substr(1, close - 1);
    pass(close + 1);
  }

  std::string_view rest_;
  std::string file_;
  std::size_t line_ = 1;
};

struct UrdfJoint {
  std::string name, type, parent, child;
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();
};
struct Urdf {
  std::string name;
  std::vector<UrdfJoint> joints;
  std::map<std::string, double> radius_of_link;  ///< of a cylinder or sphere
};

class UrdfReader {
 public:
  explicit UrdfReader(const std::filesystem::path& path)
      : file_(path.string()), text_(read_file(path)), tags_(text_, file_) {}

  Urdf read() {
    while (const std::optional<XmlTag> tag = tags_.next()) {
      if (tag->name.starts_with("xacro:"))
        throw InputError(place(file_, tag->line), "is xacro", "a URDF: xacro FILE > robot.urdf expands it");
      if (tag->is_end)
        leave(tag->name);
      else
        enter(*tag);
    }
    if (!has_robot_) throw InputError(file_, "has no element 'robot'", "a URDF");
    return std::move(urdf_);
  }

 private:
  void enter(const XmlTag& tag) {
    const auto attribute = [&](std::string_view name) {
      const auto found = tag.attributes.find(name);
      return found == tag.attributes.end() ? std::string() : std::string(found->second);
    };
    if (tag.name == "robot") {
      has_robot_ = true;
      urdf_.name = attribute("name");
    } else if (tag.name == "link" && !in_joint_) {
      link_ = tag.is_empty ? std::string() : attribute("name");
    } else if (tag.name == "joint" && !attribute("type").empty()) {  // <transmission> has joints, too
      urdf_.joints.push_back({attribute("name"), attribute("type"), {}, {}});
      in_joint_ = !tag.is_empty;
    } else if (in_joint_ && tag.name == "parent") {
      urdf_.joints.back().parent = attribute("link");
    } else if (in_joint_ && tag.name == "child") {
      urdf_.joints.back().child = attribute("link");
    } else if (in_joint_ && tag.name == "origin") {
      urdf_.joints.back().xyz = vector_in(attribute("xyz"), tag.line);
      urdf_.joints.back().rpy = vector_in(attribute("rpy"), tag.line);
    } else if (!link_.empty() && (tag.name == "cylinder" || tag.name == "sphere")) {
      const Eigen::Vector3d radius = vector_in(attribute("radius") + " 0 0", tag.line);
      if (radius.x() > 0.0) urdf_.radius_of_link[link_] = radius.x();
    }
  }
  void leave(std::string_view name) {
    if (name == "joint") in_joint_ = false;
    if (name == "link") link_.clear();
  }
  Eigen::Vector3d vector_in(const std::string& text, std::size_t line) const {
    Eigen::Vector3d vector = Eigen::Vector3d::Zero();
    const char* at = text.c_str();
    const char* const end = at + text.size();
    for (int i = 0; i < 3 && !text.empty(); ++i) {
      while (at < end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r' || *at == '+')) ++at;
      const auto [next, error] = std::from_chars(at, end, vector[i]);
      if (error != std::errc() || !std::isfinite(vector[i]))
        throw InputError(place(file_, line), fmt::format("'{}' are not three numbers", text), "a URDF");
      at = next;
    }
    return vector;
  }

  std::string file_;
  std::string text_;
  XmlTags tags_;
  Urdf urdf_;
  bool has_robot_ = false, in_joint_ = false;
  std::string link_;
};

/// Where a joint is in the frame of the root of the robot.
Eigen::Isometry3d root_from_joint(const Urdf& urdf, const UrdfJoint& joint) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const UrdfJoint* at = &joint;
  for (std::size_t depth = 0; at != nullptr && depth <= urdf.joints.size(); ++depth) {
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    step.translate(at->xyz);
    step.rotate(Eigen::AngleAxisd(at->rpy.z(), Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(at->rpy.y(), Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(at->rpy.x(), Eigen::Vector3d::UnitX()));
    pose = step * pose;
    const auto above = std::ranges::find(urdf.joints, at->parent, &UrdfJoint::child);
    at = above == urdf.joints.end() ? nullptr : &*above;
  }
  return pose;
}

}  // namespace

RobotGeometry read_urdf(const std::filesystem::path& path) {
  const Urdf urdf = UrdfReader(path).read();
  RobotGeometry geometry;
  geometry.robot_name = urdf.name;
  for (const UrdfJoint& joint : urdf.joints) {
    if (joint.type != "continuous") continue;
    const Eigen::Vector3d at = root_from_joint(urdf, joint).translation();
    WheelGeometry wheel{.joint = joint.name, .x_m = at.x(), .y_m = at.y()};
    if (const auto radius = urdf.radius_of_link.find(joint.child); radius != urdf.radius_of_link.end())
      wheel.radius_m = radius->second;
    geometry.wheels.push_back(std::move(wheel));
  }
  if (geometry.wheels.empty())
    throw InputError(path.string(), "has no joint of type continuous", "the wheels' joints");
  return geometry;
}

}  // namespace trundle::pipeline
