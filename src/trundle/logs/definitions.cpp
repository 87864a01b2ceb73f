#include "trundle/logs/definitions.hpp"

namespace trundle::logs {

Layout layout_of(const Channel& channel, const Definitions&) {
  if (channel.layout) return *channel.layout;
  throw BadDefinition("definitions are not read yet");
}

}  // namespace trundle::logs
