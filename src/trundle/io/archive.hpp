#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "trundle/namespaces.hpp"

namespace trundle::io {

// The state of a value as bytes, and back, to the last bit. A type tells its state once, for both directions:
//
//   template <class Archive, class Self>
//   static void persist(Archive& archive, Self& self) { archive(self.pose_, self.weights_); }
//
// Numbers, enums, strings, sequences, maps and matrices are known here. Only what changes is stored: sizes
// and settings that a constructor fixes are there already when a state is read.

static_assert(std::endian::native == std::endian::little, "states are stored with the lowest byte first");

/// The bytes are not the state of such a value.
class DamagedState : public std::runtime_error {
 public:
  DamagedState() : std::runtime_error("is not the state of this") {}
};

template <class T>
concept PlainNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;
/// Eigen's.
template <class T>
concept MatrixLike = requires(T& m) {
  { m.rows() } -> std::convertible_to<std::ptrdiff_t>;
  { m.cols() } -> std::convertible_to<std::ptrdiff_t>;
  {m.data()};
  m.derived();
};
template <class T>
concept SequenceLike = requires(T& v) {
  v.begin();
  v.end();
  { v.size() } -> std::convertible_to<std::size_t>;
  typename T::value_type;
}
&&!MatrixLike<T>;
template <class T>
concept MapLike = SequenceLike<T> && requires {
  typename T::mapped_type;
};
/// Numbers in one piece of memory.
template <class T>
concept Contiguous = SequenceLike<T> && PlainNumber<typename T::value_type> && requires(T& v) {
  v.data();
};

class StateWriter {
 public:
  static constexpr bool kReads = false;

  template <class... T>
  void operator()(const T&... values) {
    (write(values), ...);
  }
  std::string take() { return std::move(bytes_); }

 private:
  void write_bytes(const void* from, std::size_t count) {
    if (count > 0) bytes_.append(static_cast<const char*>(from), count);
  }
  template <class T>
  void write(const T& value) {
    if constexpr (PlainNumber<T>) {
      write_bytes(&value, sizeof value);
    } else if constexpr (MatrixLike<T>) {
      write(static_cast<std::int64_t>(value.rows()));
      write(static_cast<std::int64_t>(value.cols()));
      write_bytes(value.data(),
                  static_cast<std::size_t>(value.rows() * value.cols()) * sizeof(*value.data()));
    } else if constexpr (Contiguous<T>) {
      write(static_cast<std::uint64_t>(value.size()));
      write_bytes(value.data(), value.size() * sizeof(*value.data()));
    } else if constexpr (SequenceLike<T>) {
      write(static_cast<std::uint64_t>(value.size()));
      for (const auto& element : value) write(element);
    } else {
      T::persist(*this, value);
    }
  }
  template <class A, class B>
  void write(const std::pair<A, B>& pair) {
    (*this)(pair.first, pair.second);
  }
  template <class T>
  void write(const std::optional<T>& value) {
    write(value.has_value());
    if (value) write(*value);
  }

  std::string bytes_;
};

class StateReader {
 public:
  static constexpr bool kReads = true;

  /// The bytes must outlive the reader.
  explicit StateReader(std::string_view bytes) : bytes_(bytes) {}

  /// Throws DamagedState where the bytes end too early or cannot be such values.
  template <class... T>
  void operator()(T&... values) {
    (read(values), ...);
  }
  /// Throws DamagedState where bytes are left over.
  void finish() const {
    if (!bytes_.empty()) throw DamagedState();
  }

 private:
  void read_bytes(void* to, std::size_t count) {
    if (count > bytes_.size()) throw DamagedState();
    if (count > 0) std::memcpy(to, bytes_.data(), count);
    bytes_.remove_prefix(count);
  }
  /// A number of elements, each of one byte at least.
  std::size_t read_size() {
    std::uint64_t size = 0;
    read(size);
    if (size > bytes_.size()) throw DamagedState();
    return static_cast<std::size_t>(size);
  }
  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      unsigned char byte = 0;
      read_bytes(&byte, 1);
      value = byte != 0;
    } else if constexpr (PlainNumber<T>) {
      read_bytes(&value, sizeof value);
    } else if constexpr (MatrixLike<T>) {
      read_matrix(value);
    } else if constexpr (Contiguous<T>) {
      resize(value, read_size());
      read_bytes(value.data(), value.size() * sizeof(*value.data()));
    } else if constexpr (MapLike<T>) {
      value.clear();
      for (std::size_t left = read_size(); left > 0; --left) {
        typename T::key_type key{};
        typename T::mapped_type mapped{};
        (*this)(key, mapped);
        value.emplace_hint(value.end(), std::move(key), std::move(mapped));
      }
    } else if constexpr (SequenceLike<T>) {
      resize(value, read_size());
      for (auto& element : value) read(element);
    } else {
      T::persist(*this, value);
    }
  }
  template <class A, class B>
  void read(std::pair<A, B>& pair) {
    (*this)(pair.first, pair.second);
  }
  template <class T>
  void read(std::optional<T>& value) {
    bool there = false;
    read(there);
    value.reset();
    if (!there) return;
    T element{};
    read(element);
    value = std::move(element);
  }
  template <class T>
  void read_matrix(T& matrix) {
    std::int64_t rows = 0;
    std::int64_t columns = 0;
    (*this)(rows, columns);
    const auto most = static_cast<std::int64_t>(bytes_.size());
    if (rows < 0 || columns < 0 || rows > most || columns > most) throw DamagedState();
    if (rows > 0 && columns > most / rows) throw DamagedState();
    const auto fits = [](std::int64_t size, int fixed, int largest) {  // each -1: any
      return (fixed < 0 || size == fixed) && (largest < 0 || size <= largest);
    };
    if (!fits(rows, T::RowsAtCompileTime, T::MaxRowsAtCompileTime) ||
        !fits(columns, T::ColsAtCompileTime, T::MaxColsAtCompileTime))
      throw DamagedState();
    matrix.resize(rows, columns);
    read_bytes(matrix.data(), static_cast<std::size_t>(rows * columns) * sizeof(*matrix.data()));
  }
  template <class T>
  static void resize(T& sequence, std::size_t size) {
    if (sequence.size() == size) return;
    if constexpr (requires { sequence.resize(size); } &&
                  std::is_default_constructible_v<typename T::value_type>)
      sequence.resize(size);
    else
      throw DamagedState();
  }

  std::string_view bytes_;
};

template <class T>
[[nodiscard]] std::string state_of(const T& value) {
  StateWriter writer;
  writer(value);
  return writer.take();
}

/// `value` must have been made as the one whose state this is. Throws DamagedState; it is then worth nothing.
template <class T>
void resume_state(T& value, std::string_view state) {
  StateReader reader(state);
  reader(value);
  reader.finish();
}

}  // namespace trundle::io
