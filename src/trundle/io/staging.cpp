#include "trundle/io/staging.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "trundle/io/error.hpp"
#include "trundle/io/finite.hpp"

namespace trundle::io {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStagedEnding = ".trundle-new";

/// Ctrl-C and its like wait for as long as this lives: what is being written is not left lying about.
class SignalsWait {
 public:
  SignalsWait() {
    sigset_t ends;
    sigemptyset(&ends);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
    pthread_sigmask(SIG_BLOCK, &ends, &before_);
  }
  ~SignalsWait() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

 private:
  sigset_t before_{};
};

[[noreturn]] void refuse(const fs::path& path, int reason) {
  throw InputError(path.string(), std::strerror(reason), "a place that can be written");
}

fs::path staged_name(const fs::path& path) {
  return fmt::format(".{}{}", path.filename().string(), kStagedEnding);
}

void write_all(int descriptor, std::string_view content, const fs::path& path) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno != EINTR) refuse(path, errno);
    if (written > 0) content.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Opens a new or a left folder that nobody else has.
Descriptor claim_folder(const fs::path& staged, const fs::path& given) {
  while (true) {
    if (::mkdir(staged.c_str(), 0777) != 0 && errno != EEXIST) refuse(given, errno);
    Descriptor folder(::open(staged.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (folder.number() < 0 && errno == ENOENT) continue;  // its holder has just ended
    if (folder.number() < 0) refuse(staged, errno);
    if (folder.try_lock() == EWOULDBLOCK)
      throw InputError(given.string(), "is in use by another run",
                       "a folder for each, or one after the other");
    if (!folder.is_at(staged)) continue;
    for (const auto& left : fs::directory_iterator(staged)) fs::remove_all(left.path());
    return folder;
  }
}

Descriptor claim_file(const fs::path& staged, const fs::path& path) {
  while (true) {
    Descriptor file(::open(staged.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666));
    if (file.number() < 0) refuse(path, errno);
    ::flock(file.number(), LOCK_EX);
    if (file.is_at(staged)) return file;
  }
}

/// A mount point cannot be renamed, nor a folder beside it be moved into it.
bool is_mount_point(const fs::path& folder) {
  struct statx here {
  }, above{};
  if (::statx(AT_FDCWD, folder.c_str(), 0, STATX_MNT_ID, &here) != 0) return true;
  if (::statx(AT_FDCWD, folder.parent_path().c_str(), 0, STATX_MNT_ID, &above) != 0) return true;
  return here.stx_mnt_id != above.stx_mnt_id;
}

/// Beside the folder; within it where only that can be written.
fs::path place_for(const fs::path& folder) {
  const bool within =
      fs::exists(folder) && (is_mount_point(folder) || ::access(folder.parent_path().c_str(), W_OK) != 0);
  return (within ? folder : folder.parent_path()) / staged_name(folder);
}

fs::path first_missing(fs::path folder) {
  fs::path missing;
  for (; !fs::exists(folder); folder = folder.parent_path()) missing = folder;
  return missing;
}

bool is_within(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

/// The folders up to the first that was created, if any was.
void remove_empty(fs::path folder, const fs::path& first_created) {
  if (first_created.empty()) return;
  for (; is_within(folder, first_created); folder = folder.parent_path())
    if (::rmdir(folder.c_str()) != 0) break;
}

bool holds_any_of(const std::string& folder, const std::set<std::string>& names) {
  const auto first = names.lower_bound(folder + "/");
  return first != names.end() && first->starts_with(folder + "/");
}

/// Gives all that is not of `replaced` a second name in `to`. False where that cannot be had.
bool carry_over(const fs::path& from, const fs::path& to, const std::set<std::string>& replaced) {
  std::error_code unreadable, ignored;
  for (auto entry = fs::recursive_directory_iterator(from, unreadable); entry != fs::end(entry);
       entry.increment(unreadable)) {
    const std::string name = entry->path().lexically_relative(from).generic_string();
    const bool is_folder = entry->is_directory() && !entry->is_symlink();
    if (is_folder != holds_any_of(name, replaced)) return false;  // the user's: of any size, or a link
    if (is_folder || replaced.contains(name)) continue;
    const fs::path copy = to / name;
    fs::create_directories(copy.parent_path(), ignored);
    if (::linkat(AT_FDCWD, entry->path().c_str(), AT_FDCWD, copy.c_str(), 0) != 0) return false;
  }
  return !unreadable;
}

/// Files below a folder, by their names in it.
std::set<std::string> names_below(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (!entry.is_directory()) names.insert(entry.path().lexically_relative(folder).generic_string());
  return names;
}

void refuse_other_than_file(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    throw InputError(path.string(), fs::is_directory(path, error) ? "is a folder" : "is no file",
                     "a place that can be written");
}

/// A file that is complete on the disk, beside the one whose place it takes. Its name is fixed and it is
/// locked: who finds it without a lock knows that its writer was killed.
class StagedFile {
 public:
  explicit StagedFile(const FileContent& file)
      : path_(file.path), staged_(path_.parent_path() / staged_name(path_)) {
    refuse_other_than_file(path_);
    std::error_code error;
    const fs::path folder = fs::absolute(path_).parent_path();
    const fs::path first_created = first_missing(folder);
    fs::create_directories(folder, error);
    file_ = claim_file(staged_, path_);
    try {
      if (::ftruncate(file_.number(), 0) != 0) refuse(path_, errno);
      FiniteNumbers numbers(path_);
      const auto write = [&](std::string_view piece) {
        numbers.require_in(piece);
        write_all(file_.number(), piece, path_);
      };
      write(file.content);
      if (file.rest) file.rest(write);
    } catch (...) {
      fs::remove(staged_, error);
      remove_empty(folder, first_created);
      throw;
    }
  }
  ~StagedFile() {
    std::error_code gone;
    if (!staged_.empty()) fs::remove(staged_, gone);
  }
  StagedFile(const StagedFile&) = delete;
  StagedFile& operator=(const StagedFile&) = delete;

  void commit() {
    if (::rename(staged_.c_str(), path_.c_str()) != 0) refuse(path_, errno);
    staged_.clear();
  }

 private:
  fs::path path_;
  fs::path staged_;  ///< empty: it has taken its place
  Descriptor file_;
};

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

int Descriptor::try_lock() const {
  return ::flock(number_, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
}

bool Descriptor::is_at(const fs::path& path) const {
  struct stat open {
  }, named{};
  return ::fstat(number_, &open) == 0 && ::lstat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

void write_set(std::vector<FileContent> files) {
  const SignalsWait signals_wait;
  std::ranges::sort(files, {}, &FileContent::path);  // two sets with a file in common wait in one order
  std::vector<std::unique_ptr<StagedFile>> staged;
  for (const FileContent& file : files) staged.push_back(std::make_unique<StagedFile>(file));
  for (const auto& file : staged) file->commit();
}

ResultFolder::ResultFolder(const fs::path& folder)
    : given_(folder),
      folder_(fs::weakly_canonical(fs::absolute(folder))),
      on_interruption_([this] { take_back(); }) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // of "out/"
  std::error_code error;
  if (fs::exists(folder_, error) && !fs::is_directory(folder_, error))
    throw InputError(given_.string(), "is no folder", "a folder for results");
  if (fs::exists(folder_) && ::access(folder_.c_str(), W_OK) != 0) refuse(given_, errno);
  const auto held = on_interruption_.hold();
  first_created_ = first_missing(folder_.parent_path());
  fs::create_directories(folder_.parent_path(), error);
  if (error) refuse(given_, error.value());
  const fs::path staged = place_for(folder_);
  remove_stale(staged.parent_path());
  lock_ = claim_folder(staged, given_);
  staged_ = staged;
}

ResultFolder::~ResultFolder() {
  const auto held = on_interruption_.hold();
  take_back();
}

void ResultFolder::take_back() {
  if (staged_.empty()) return;
  std::error_code still_written;
  while (fs::remove_all(staged_, still_written) == static_cast<std::uintmax_t>(-1) &&
         still_written == std::errc::directory_not_empty) {
  }
  remove_empty(folder_.parent_path(), first_created_);
}

fs::path ResultFolder::staged(const fs::path& path) const {
  return staged_ / path.lexically_relative(given_);
}

void ResultFolder::write(const fs::path& path, std::string_view content,
                         const std::function<void(const TakeText&)>& rest) const {
  FiniteNumbers numbers(path);
  numbers.require_in(content);
  const fs::path staged = this->staged(path);
  std::error_code error;
  fs::create_directories(staged.parent_path(), error);
  const Descriptor file(::open(staged.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.number() < 0) refuse(path, errno);
  write_all(file.number(), content, path);
  if (!rest) return;
  try {
    rest([&](std::string_view piece) {
      numbers.require_in(piece);
      write_all(file.number(), piece, path);
    });
  } catch (...) {
    fs::remove(staged, error);
    throw;
  }
}

void ResultFolder::discard(const fs::path& path) const {
  fs::remove_all(staged(path));
}

void ResultFolder::commit(const std::set<std::string>& own, const std::string& index) {
  const auto held = on_interruption_.hold();
  const std::set<std::string> written = names_below(staged_);
  std::set<std::string> replaced = own;
  replaced.insert(written.begin(), written.end());
  if (::renameat2(AT_FDCWD, staged_.c_str(), AT_FDCWD, folder_.c_str(), RENAME_NOREPLACE) == 0)
    staged_.clear();
  else if (!exchange(replaced))
    replace_each(written, own, index);
  first_created_.clear();
}

bool ResultFolder::exchange(const std::set<std::string>& replaced) {
  std::error_code gone;
  if (is_within(staged_, folder_) || is_within(fs::current_path(gone), folder_)) return false;
  // Until the old folder is removed under the name of the staged one, nobody shall take it for stale.
  old_lock_ = Descriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  struct stat old {};
  return old_lock_.number() >= 0 && old_lock_.try_lock() == 0 && carry_over(folder_, staged_, replaced) &&
         ::fstat(old_lock_.number(), &old) == 0 && ::fchown(lock_.number(), old.st_uid, old.st_gid) == 0 &&
         ::fchmod(lock_.number(), old.st_mode & 07777) == 0 &&
         ::renameat2(AT_FDCWD, staged_.c_str(), AT_FDCWD, folder_.c_str(), RENAME_EXCHANGE) == 0;
}

void ResultFolder::remove_empty_above(const fs::path& name) const {
  for (fs::path folder = name.parent_path(); !folder.empty(); folder = folder.parent_path())
    if (::rmdir((folder_ / folder).c_str()) != 0) break;
}

void ResultFolder::replace_each(const std::set<std::string>& written, const std::set<std::string>& own,
                                const std::string& index) const {
  for (const std::string& name : written) {
    const fs::path parent = (folder_ / name).parent_path();
    if (fs::is_directory(folder_ / name)) refuse(given_ / name, EISDIR);
    if (fs::exists(parent) && !fs::is_directory(parent)) refuse(given_ / name, ENOTDIR);
  }
  std::error_code ignored;
  fs::create_directories(folder_, ignored);
  fs::remove(folder_ / index, ignored);
  for (const std::string& name : own)
    if (!written.contains(name) && fs::remove(folder_ / name, ignored)) remove_empty_above(name);
  const auto move = [&](const std::string& name) {
    fs::create_directories((folder_ / name).parent_path(), ignored);
    if (::rename((staged_ / name).c_str(), (folder_ / name).c_str()) != 0) refuse(given_ / name, errno);
  };
  for (const std::string& name : written)
    if (name != index) move(name);
  if (written.contains(index)) move(index);
}

void remove_stale(const fs::path& folder) {
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, unreadable)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') || !name.ends_with(kStagedEnding)) continue;
    const Descriptor stale(::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (stale.number() >= 0 && stale.try_lock() == 0 && stale.is_at(entry.path()))
      fs::remove_all(entry.path(), unreadable);
  }
}

}  // namespace trundle::io
