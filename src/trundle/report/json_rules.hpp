#pragma once

#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

enum JsonType : unsigned {
  kString = 1,
  kNumber = 2,
  kBool = 4,
  kArray = 8,
  kObject = 16,
  kNull = 32,
  kMissing = 64,  ///< in a rule: the key may be absent
};

struct JsonRule {
  std::string_view path;  ///< keys from the root; "*": every element
  unsigned types;         ///< any of these
};

/// Parses a file's text. Throws InputError with file and line where it is not JSON.
nlohmann::ordered_json parse_json(std::string_view text, std::string_view file_name,
                                  std::string_view expected);

/// Parses a result as trundle writes it, `name` telling which, and checks it. Throws InputError.
nlohmann::ordered_json parse_result(std::string_view text, std::string_view name,
                                    std::span<const JsonRule> rules, std::string_view file_name);

/// Throws InputError where a value is missing or of another type. A rule is skipped where an earlier one
/// found null, or nothing where nothing is allowed.
void check_rules(const nlohmann::ordered_json& document, std::span<const JsonRule> rules,
                 std::string_view file_name);

/// The named arrays of an object, where the document has it, are columns of one table: throws InputError
/// where one is missing or longer than the first.
void expect_same_lengths(const nlohmann::ordered_json& document, const char* name,
                         std::span<const char* const> columns, std::string_view file_name);

}  // namespace trundle::report
