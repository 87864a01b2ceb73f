#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/io/interruption.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/namespaces.hpp"

namespace trundle::io {

/// An open file or folder. Its lock (flock) ends with its holder, however that ends.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();

  int number() const { return number_; }
  /// 0, or why not: EWOULDBLOCK where another holds the lock.
  int try_lock() const;
  /// Whether `path` still names what is open here.
  bool is_at(const std::filesystem::path& path) const;

 private:
  int number_;
};

/// A file's place and what it is to hold.
struct FileContent {
  std::filesystem::path path;
  std::string_view content;
  /// What follows it, in pieces of whole lines: called while the file is written.
  std::function<void(const TakeText&)> rest = {};
};
/// All of them or none: each is complete on the disk, under a temporary name beside its place, before the
/// first is renamed. Waits where another command writes one of them. Throws InputError as write_file.
void write_set(std::vector<FileContent> files);

/// A folder of results that are of one run: written into a folder beside it, which takes its place at the
/// end. Without commit() it stays as it was.
class ResultFolder {
 public:
  /// Throws InputError where another run writes there, or nothing can be written.
  explicit ResultFolder(const std::filesystem::path& folder);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  /// Where the new files are until then.
  const std::filesystem::path& staged() const { return staged_; }
  /// And where that one is.
  std::filesystem::path staged(const std::filesystem::path& path) const;
  /// `path` is that of the file in the folder, as it was given to the constructor. `rest`: what follows the
  /// content, in pieces of whole lines.
  void write(const std::filesystem::path& path, std::string_view content,
             const std::function<void(const TakeText&)>& rest = {}) const;
  /// Takes back what was written below it.
  void discard(const std::filesystem::path& path) const;

  /// The new files take the place of `own`, the names of all that an earlier run may have written; whatever
  /// else is in the folder stays. At one instant where the folder can be exchanged as a whole; else file by
  /// file, `index` taken away first and put there last.
  void commit(const std::set<std::string>& own, const std::string& index);

 private:
  void take_back();
  bool exchange(const std::set<std::string>& replaced);
  void remove_empty_above(const std::filesystem::path& name) const;
  void replace_each(const std::set<std::string>& written, const std::set<std::string>& own,
                    const std::string& index) const;

  std::filesystem::path given_;
  std::filesystem::path folder_;         ///< absolute, without links
  std::filesystem::path staged_;         ///< empty: it has taken its place
  std::filesystem::path first_created_;  ///< of the folders above; empty: none
  Descriptor lock_;
  Descriptor old_lock_;
  OnInterruption on_interruption_;
};

/// Removes what killed commands left in a folder.
void remove_stale(const std::filesystem::path& folder);

}  // namespace trundle::io
