#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace trundle::test {

/// A number as these formats store it, the lowest byte first.
template <class Number>
std::string bytes_of_number(Number number) {
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  return bytes;
}

inline std::string with_length(std::string_view text) {
  return bytes_of_number(static_cast<std::uint32_t>(text.size())) + std::string(text);
}

/// A WPILOG, record by record. Lengths in the heads of records are the shortest, or the longest there are.
class WpilogWriter {
 public:
  explicit WpilogWriter(std::string_view extra = "", bool longest = false, std::uint16_t version = 0x0100)
      : longest_(longest) {
    bytes_ = "WPILOG" + bytes_of_number(version) + with_length(extra);
  }
  std::uint32_t start(std::string_view name, std::string_view type, std::string_view metadata = "") {
    ++last_;
    start_as(last_, name, type, metadata);
    return last_;
  }
  void start_as(std::uint32_t id, std::string_view name, std::string_view type,
                std::string_view metadata = "") {
    record(0, std::string(1, '\0') + bytes_of_number(id) + with_length(name) + with_length(type) +
                  with_length(metadata));
  }
  void finish(std::uint32_t id) { record(0, std::string(1, '\1') + bytes_of_number(id)); }
  void set_metadata(std::uint32_t id, std::string_view metadata) {
    record(0, std::string(1, '\2') + bytes_of_number(id) + with_length(metadata));
  }
  /// At the time of the writer, in microseconds.
  void record(std::uint32_t id, std::string_view payload) {
    const auto length_of = [&](std::uint64_t number, int most) {
      int length = 1;
      while (length < most && (longest_ || number >> (8 * length) != 0)) ++length;
      return length;
    };
    const int id_length = length_of(id, 4), size_length = length_of(payload.size(), 4);
    const int time_length = length_of(time_us, 7);
    bytes_ += static_cast<char>((id_length - 1) | (size_length - 1) << 2 | (time_length - 1) << 4);
    const auto append = [&](std::uint64_t number, int length) {
      bytes_ += bytes_of_number(number).substr(0, static_cast<std::size_t>(length));
    };
    append(id, id_length);
    append(payload.size(), size_length);
    append(time_us, time_length);
    bytes_ += payload;
  }
  const std::string& bytes() const { return bytes_; }

  std::uint64_t time_us = 0;

 private:
  std::string bytes_;
  bool longest_ = false;
  std::uint32_t last_ = 0;
};

inline std::string padded(std::string_view text, std::size_t size) {
  std::string bytes(text.substr(0, size));
  bytes.resize(size, '\0');
  return bytes;
}

/// A DataFlash log, message by message.
class DataFlashWriter {
 public:
  /// `length`: of the message with its head of three bytes.
  void format(int type, int length, std::string_view name, std::string_view characters,
              std::string_view labels) {
    message(128, std::string(1, static_cast<char>(type)) + static_cast<char>(length) + padded(name, 4) +
                     padded(characters, 16) + padded(labels, 64));
  }
  void message(int type, std::string_view fields) {
    bytes_ += "\xa3\x95";
    bytes_ += static_cast<char>(type);
    bytes_ += fields;
  }
  void damage(std::string_view bytes) { bytes_ += bytes; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// A ULog, message by message.
class UlogWriter {
 public:
  explicit UlogWriter(std::uint64_t start_us = 0) {
    bytes_ = std::string("ULog\x01\x12\x35\x01", 8) + bytes_of_number(start_us);
  }
  void message(char type, std::string_view bytes) {
    bytes_ += bytes_of_number(static_cast<std::uint16_t>(bytes.size())) + type + std::string(bytes);
  }
  /// Which data were appended where; the place of the first offset is returned.
  std::size_t flags(std::uint8_t incompatible, std::uint64_t appended = 0) {
    std::string bytes(40, '\0');
    bytes[8] = static_cast<char>(incompatible);
    message('B', bytes);
    const std::size_t place = bytes_.size() - 24;
    bytes_.replace(place, 8, bytes_of_number(appended));
    return place;
  }
  void define(std::string_view text) { message('F', text); }
  void subscribe(int instance, std::uint16_t id, std::string_view name) {
    message('A', std::string(1, static_cast<char>(instance)) + bytes_of_number(id) + std::string(name));
  }
  void data(std::uint16_t id, std::string_view fields) {
    message('D', bytes_of_number(id) + std::string(fields));
  }
  void sync() { message('S', "\x2f\x73\x13\x20\x25\x0c\xbb\x12"); }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace trundle::test
