#include <cmath>

#include "trundle/logs/field_reader.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {

LogParameters read_parameters(const std::filesystem::path& path) {
  LogParameters parameters;
  constexpr std::size_t kMostParameters = 100'000;  // ArduPilot has some 1500: what has more is damaged
  const std::unique_ptr<logs::Log> log = logs::open_log(path);
  while (const std::optional<logs::Message> message = log->next()) {
    if (message->channel->type != "PARM" || !message->channel->layout) continue;
    std::string name;
    std::optional<double> value;
    logs::visit(*message->channel->layout, message->channel->encoding, message->bytes,
                [&](std::string_view field, const logs::Value& content) {
                  const auto* const text = std::get_if<std::string_view>(&content);
                  if (field == "Name" && text != nullptr) name = *text;
                  if (field == "Value") value = logs::number_of(content);
                });
    if (!name.empty() && value && std::isfinite(*value) && parameters.size() < kMostParameters)
      parameters[name] = *value;
  }
  return parameters;
}

}  // namespace trundle::pipeline
