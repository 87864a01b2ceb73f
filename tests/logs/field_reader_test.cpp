#include "trundle/logs/field_reader.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/logs/definitions.hpp"

#include "ros_writers.hpp"

namespace trundle::test {
namespace {

using namespace logs;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kDetections = R"(std_msgs/Header header
int64 large
string[] name
float64[] position
Detection[] detections
===
MSG: a/Detection
string frame
int32 id
geometry_msgs/Point at
)";

/// The same message in either order of bytes.
std::string detections(bool big_endian) {
  CdrBytes bytes(big_endian);
  bytes.put(std::int32_t{12}).put(std::uint32_t{500'000'000}).text("map");
  bytes.put(std::numeric_limits<std::int64_t>::max());
  bytes.put(std::uint32_t{2}).text("left").text("right");
  bytes.put(std::uint32_t{2}).put(0.5).put(-0.25);
  bytes.put(std::uint32_t{2});
  bytes.text("camera").put(std::int32_t{7}).put(1.0).put(2.0).put(3.0);
  bytes.text("x").put(std::int32_t{-9}).put(4.0).put(5.0).put(6.0);
  return bytes.bytes();
}

class Cdr : public testing::TestWithParam<bool> {
 protected:
  Value read(std::string_view path) const { return reader(path).read(message()); }
  FieldReader reader(std::string_view path) const { return FieldReader(layout_, Encoding::cdr, path); }
  Message message() const { return {nullptr, 77, std::as_bytes(std::span(bytes_))}; }

  Layout layout_ = parse_ros2msg("a/Root", kDetections);
  std::string bytes_ = detections(GetParam());
};

TEST_P(Cdr, paths_lead_to_their_fields) {
  EXPECT_EQ(read("header.stamp"), Value(std::int64_t{12'500'000'000}));
  EXPECT_EQ(read("header.frame_id"), Value(std::string_view("map")));
  EXPECT_EQ(read("large"), Value(std::numeric_limits<std::int64_t>::max()));  // no double holds it
  EXPECT_EQ(read("position[1]"), Value(-0.25));
  EXPECT_EQ(read("position[joint=right]"), Value(-0.25));
  EXPECT_EQ(read("position[name=left]"), Value(0.5));
  EXPECT_EQ(read("detections[id=-9].at.y"), Value(5.0));
  EXPECT_EQ(read("detections[frame=camera,id=7].at.z"), Value(3.0));
  EXPECT_EQ(read("log_time"), Value(std::int64_t{77}));
}

TEST_P(Cdr, what_is_not_there_is_nothing) {
  EXPECT_EQ(read("position[2]"), Value());
  EXPECT_EQ(read("position[joint=middle]"), Value());
  EXPECT_EQ(read("detections[frame=camera,id=8].at.z"), Value());
}

TEST_P(Cdr, every_element_is_read) {
  std::vector<Value> values;
  reader("detections[].id").read_all(message(), values);
  EXPECT_THAT(values, ElementsAre(Value(std::int64_t{7}), Value(std::int64_t{-9})));
  EXPECT_TRUE(reader("detections[].id").is_repeated());
  EXPECT_FALSE(reader("detections[0].id").is_repeated());
  EXPECT_TRUE(reader("header.stamp").is_time());
}

TEST_P(Cdr, visit_meets_every_field_once) {
  std::vector<std::string> paths;
  EXPECT_TRUE(visit(layout_, Encoding::cdr, message().bytes,
                    [&](std::string_view path, const Value&) { paths.emplace_back(path); }));
  EXPECT_THAT(paths, ElementsAre("header.stamp", "header.frame_id", "large", "name[0]", "name[1]",
                                 "position[0]", "position[1]", "detections[0].frame", "detections[0].id",
                                 "detections[0].at.x", "detections[0].at.y", "detections[0].at.z",
                                 "detections[1].frame", "detections[1].id", "detections[1].at.x",
                                 "detections[1].at.y", "detections[1].at.z"));
}

TEST_P(Cdr, a_message_that_breaks_off_gives_what_comes_before) {
  const std::string whole = bytes_;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    bytes_ = whole.substr(0, size);
    EXPECT_FALSE(visit(layout_, Encoding::cdr, message().bytes, [](std::string_view, const Value&) {}))
        << size;
    EXPECT_EQ(read("detections[1].at.z"), Value()) << size;
  }
}

INSTANTIATE_TEST_SUITE_P(FieldReader, Cdr, testing::Bool(),
                         [](const auto& of) { return of.param ? "big_endian" : "little_endian"; });

TEST(FieldReader, parameter_lists_and_unknown_encapsulations_are_refused_in_words) {
  const Layout layout = parse_ros2msg("a/Root", "int32 x\n");
  for (const int kind : {2, 3, 10, 11, 4, 0x12, 0x7f}) {
    const std::string bytes{'\0', static_cast<char>(kind), '\0', '\0', '\1', '\0', '\0', '\0'};
    const auto message = std::as_bytes(std::span(bytes));
    EXPECT_FALSE(visit(layout, Encoding::cdr, message, [](std::string_view, const Value&) {}));
    EXPECT_THAT(fault_of_encapsulation(Encoding::cdr, message),
                HasSubstr(kind == 4 || kind == 0x7f ? "none of CDR's" : "parameter lists"))
        << kind;
  }
  EXPECT_EQ(fault_of_encapsulation(Encoding::cdr, std::as_bytes(std::span("\0\1\0\0", 4))), "");
}

// ---- XCDR2 ----

constexpr const char* kStates = R"(builtin_interfaces/Time stamp
float64 x
int8 flag
float64 y
Inner[] inner
string[] name
float32[3] fixed
int32 last
===
MSG: a/Inner
int8 id
float64 value
)";

/// By the rules of XTypes: 8 bytes aligned to 4, lengths before arrays of what are no numbers and, where
/// structures may grow, before each of them. `more`: fields of a later definition at the end of each
/// structure.
std::string states(bool big_endian, int kind, bool more = false) {
  const bool is_delimited = kind == 8 || kind == 0x14;
  CdrBytes bytes(big_endian, kind);
  const auto structure = [&](auto write) {
    if (!is_delimited) return write();
    bytes.delimited([&] {
      write();
      if (more) bytes.put(std::int8_t{99}).put(0.5);
    });
  };
  structure([&] {
    structure([&] { bytes.put(std::int32_t{3}).put(std::uint32_t{4}); });
    bytes.put(1.5).put(std::int8_t{-1}).put(2.5);
    bytes.delimited([&] {
      bytes.put(std::uint32_t{2});
      structure([&] { bytes.put(std::int8_t{7}).put(0.25); });
      structure([&] { bytes.put(std::int8_t{8}).put(0.75); });
    });
    bytes.delimited([&] { bytes.put(std::uint32_t{2}).text("left").text("right"); });
    bytes.put(1.0F).put(2.0F).put(3.0F).put(std::int32_t{-9});
  });
  return bytes.bytes();
}

TEST(FieldReader, version_2_of_cdr_is_read_where_structures_are_final_or_may_grow) {
  const Layout layout = parse_ros2msg("a/Root", kStates);
  for (const bool big_endian : {false, true})
    for (const int kind : {6, 8, 0x10, 0x14})
      for (const bool more : {false, true}) {
        const std::string bytes = states(big_endian, kind, more);
        const Message message{nullptr, 0, std::as_bytes(std::span(bytes))};
        std::string fields;
        EXPECT_TRUE(
            visit(layout, Encoding::cdr, message.bytes, [&](std::string_view path, const Value& value) {
              const auto* const text = std::get_if<std::string_view>(&value);
              fields +=
                  fmt::format("{}={} ", path,
                              text != nullptr ? std::string(*text) : fmt::format("{}", *number_of(value)));
            }));
        EXPECT_EQ(fields,
                  "stamp=3000000004 x=1.5 flag=-1 y=2.5 inner[0].id=7 inner[0].value=0.25 inner[1].id=8 "
                  "inner[1].value=0.75 name[0]=left name[1]=right fixed[0]=1 fixed[1]=2 fixed[2]=3 last=-9 ")
            << kind;
        const auto read = [&](const char* path) {
          return FieldReader(layout, Encoding::cdr, path).read(message);
        };
        EXPECT_EQ(read("inner[id=8].value"), Value(0.75));
        EXPECT_EQ(read("inner[1].value"), Value(0.75));
        EXPECT_EQ(read("fixed[2]"), Value(3.0));
        EXPECT_EQ(read("last"), Value(std::int64_t{-9}));
      }
}

TEST(FieldReader, a_structure_of_an_earlier_version_lacks_its_last_fields_alone) {
  const Layout layout =
      parse_ros2msg("a/Root", "Inner inner\nint32 last\n===\nMSG: a/Inner\nint32 a\nint32 b\n");
  CdrBytes bytes(false, 8);
  bytes.delimited([&] { bytes.delimited([&] { bytes.put(std::int32_t{1}); }).put(std::int32_t{2}); });
  const std::string text = bytes.bytes();
  const Message message{nullptr, 0, std::as_bytes(std::span(text))};
  std::string paths;
  EXPECT_TRUE(visit(layout, Encoding::cdr, message.bytes,
                    [&](std::string_view path, const Value&) { paths += std::string(path) + " "; }));
  EXPECT_EQ(paths, "inner.a last ");
  EXPECT_EQ(FieldReader(layout, Encoding::cdr, "inner.b").read(message), Value());
  EXPECT_EQ(FieldReader(layout, Encoding::cdr, "last").read(message), Value(std::int64_t{2}));
}

/// Annotations of IDL go before what the message's header says of structures without any.
TEST(FieldReader, idl_says_which_structures_may_grow) {
  const Layout layout = parse_ros2idl("a/msg/Root", R"idl(module a { module msg {
    @appendable struct Grows { long a; };
    @extensibility(FINAL) struct Stays { long b; };
    struct Root { Grows grows; Stays stays; long last; };
  }; };)idl");
  for (const int kind : {6, 8}) {
    CdrBytes bytes(false, kind);
    const auto root = [&] {
      bytes.delimited([&] { bytes.put(std::int32_t{1}); });
      bytes.put(std::int32_t{2}).put(std::int32_t{3});
    };
    kind == 8 ? (void)bytes.delimited(root) : root();
    const std::string text = bytes.bytes();
    const Message message{nullptr, 0, std::as_bytes(std::span(text))};
    EXPECT_EQ(FieldReader(layout, Encoding::cdr, "stays.b").read(message), Value(std::int64_t{2}));
    EXPECT_EQ(FieldReader(layout, Encoding::cdr, "last").read(message), Value(std::int64_t{3}));
  }
  for (const char* const refused :
       {"@mutable struct Root { long a; };", "@extensibility(MUTABLE) struct Root { long a; };",
        "struct Root { @optional long a; };", "@bit_bound(8) enum E { A }; struct Root { E a; };"})
    EXPECT_THROW((void)parse_ros2idl("Root", refused), BadDefinition) << refused;
}

TEST(FieldReader, no_cut_or_damage_of_version_2_is_read_beyond_its_end) {
  const Layout layout = parse_ros2msg("a/Root", kStates);
  const std::string whole = states(false, 8);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(visit(layout, Encoding::cdr, std::as_bytes(std::span(whole).first(size)),
                       [](std::string_view, const Value&) {}))
        << size;
  for (std::size_t at = 4; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = '\xff';
    (void)visit(layout, Encoding::cdr, std::as_bytes(std::span(damaged)),
                [](std::string_view, const Value&) {});
  }
}

TEST(FieldReader, times_of_ros_1_are_nanoseconds_and_durations_have_a_sign) {
  const Layout layout = parse_ros1msg("a/Root", "time t\nduration d\n");
  const std::string bytes = RosBytes()
                                .put(std::uint32_t{4'000'000'000})
                                .put(std::uint32_t{7})
                                .put(std::int32_t{-2})
                                .put(std::int32_t{-5})
                                .bytes();
  const Message message{nullptr, 0, std::as_bytes(std::span(bytes))};
  EXPECT_EQ(FieldReader(layout, Encoding::ros1, "t").read(message),
            Value(std::int64_t{4'000'000'000'000'000'007}));
  EXPECT_EQ(FieldReader(layout, Encoding::ros1, "d").read(message), Value(std::int64_t{-2'000'000'005}));
}

TEST(FieldReader, lengths_beyond_the_message_are_no_elements) {
  const Layout layout =
      parse_ros1msg("a/Root", "Empty[4000000000] nothing\nfloat64[] many\n===\nMSG: a/Empty\n");
  const std::string bytes = RosBytes().put(std::uint32_t{0xFFFFFFFF}).put(1.0).bytes();
  const Message message{nullptr, 0, std::as_bytes(std::span(bytes))};
  EXPECT_EQ(FieldReader(layout, Encoding::ros1, "many[0]").read(message), Value());
  EXPECT_FALSE(visit(layout, Encoding::ros1, message.bytes, [](std::string_view, const Value&) {}));
}

/// What is said of a path that leads nowhere, and what is expected.
std::string complaint_about(std::string_view path) {
  try {
    const FieldReader reader(parse_ros2msg("a/Root", kDetections), Encoding::cdr, path);
  } catch (const UnknownField& error) {
    return std::string(error.what()) + " | " + error.expectation;
  }
  return "none";
}

TEST(FieldReader, a_path_that_leads_nowhere_is_refused_with_what_is_there) {
  EXPECT_THAT(complaint_about("positions[0]"), HasSubstr("has no field 'positions' | 'position'"));
  EXPECT_THAT(complaint_about("header"), HasSubstr("is a structure | one of its fields: stamp, frame_id"));
  EXPECT_THAT(complaint_about("position"), HasSubstr("is an array"));
  EXPECT_THAT(complaint_about("large[0]"), HasSubstr("'large' is no array"));
  EXPECT_THAT(complaint_about("large.x"), HasSubstr("has no fields"));
  EXPECT_THAT(complaint_about("position[left]"), HasSubstr("selects no element"));
  EXPECT_THAT(complaint_about("detections[color=red].id"), HasSubstr("has no field 'color'"));
}

TEST(FieldReader, bit_fields_share_their_integer) {
  std::vector<LayoutField> fields;
  fields.push_back({.name = "low", .type = FieldType::int8, .bits = 3, .first_bit = 0, .keeps_place = true});
  fields.push_back({.name = "high", .type = FieldType::uint8, .bits = 5, .first_bit = 3});
  fields.push_back({.name = "scaled", .type = FieldType::int16, .scale = 0.01});
  fields.push_back({.name = "text", .type = FieldType::character, .arity = FieldArity::fixed, .count = 4});
  const Layout layout({{.name = "packed", .fields = fields}});
  const std::string bytes = RosBytes()
                                .put(std::uint8_t{0b10110'111})
                                .put(std::int16_t{-150})

                                .raw(std::string("ab\0c", 4))
                                .bytes();
  const Message message{nullptr, 0, std::as_bytes(std::span(bytes))};
  const auto read = [&](const char* path) {
    return FieldReader(layout, Encoding::packed, path).read(message);
  };
  EXPECT_EQ(read("low"), Value(std::int64_t{-1}));
  EXPECT_EQ(read("high"), Value(std::uint64_t{0b10110}));
  EXPECT_EQ(read("scaled"), Value(-1.5));
  EXPECT_EQ(read("text"), Value(std::string_view("ab")));
}

}  // namespace
}  // namespace trundle::test
