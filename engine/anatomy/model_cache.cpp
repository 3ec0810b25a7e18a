#include "engine/anatomy/model_cache.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fmt/format.h>
#include <mutex>
#include <set>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "physics/geometry/checksum.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

/// Beginnings of the names of what is kept.
constexpr std::string_view ct_names = "ct-";
constexpr std::array<std::string_view, 5> kept_names = {"anatomy-", "field-", "body-", "view-", ct_names};

std::array<std::atomic<int>, 4> made_here = {};  // by Made

struct Seal {
    char magic[8] = {'S', 'E', 'L', 'D', 'K', 'E', 'P', 'T'};
    std::uint64_t key = 0, checksum = 0;
};

bool is_first(const fs::path& folder) {
    static std::mutex mutex;
    static std::set<fs::path> seen;
    const std::lock_guard lock(mutex);
    return seen.insert(folder).second;
}

std::uintmax_t size_of_item(const fs::path& path) {
    std::error_code failed;
    if (!fs::is_directory(path, failed)) {
        const std::uintmax_t bytes = fs::is_regular_file(path, failed) ? fs::file_size(path, failed) : 0;
        return failed ? 0 : bytes;
    }
    std::uintmax_t bytes = 0;
    for (fs::recursive_directory_iterator entry(path, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        std::error_code none;
        if (!entry->is_regular_file(none)) continue;
        const std::uintmax_t one = entry->file_size(none);
        if (!none) bytes += one;
    }
    return bytes;
}

/// Why nothing can be put into the folder, which is made where it is not there; empty where it can.
std::string obstacle_in(const fs::path& folder) {
    if (std::string why = io::make_private_folder(folder); !why.empty()) return why;
    return ::access(folder.c_str(), W_OK | X_OK) == 0 ? std::string() : std::strerror(errno);
}

/// Removes what is no regular file from the place of one: writing to it could wait for ever, or end
/// elsewhere. Why it may still be there; empty where it is not.
std::string clear_for_file(const fs::path& path) {
    std::error_code failed;
    const fs::file_status found = fs::symlink_status(path, failed);
    if (fs::is_regular_file(found) || found.type() == fs::file_type::not_found) return {};
    if (fs::status_known(found)) fs::remove_all(path, failed);
    return failed ? fmt::format("{}: what is in its place cannot be removed: {}", path.string(),
                                failed.message())
                  : std::string();
}

/// Removes locks that processes which have ended left behind.
void remove_old_locks(const fs::path& folder) {
    std::error_code failed;
    std::vector<fs::path> locks;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        const bool ours = std::ranges::any_of(
            kept_names, [&](std::string_view start) { return name.starts_with("." + std::string(start)); });
        if (ours && name.ends_with(".lock")) locks.push_back(entry->path());
    }
    for (const fs::path& lock : locks) io::LockFile::of(lock);  // gone with the value
}

ShrunkCache removed(std::vector<CacheItem> items) {
    ShrunkCache shrunk;
    for (CacheItem& item : items) {
        std::error_code error;
        fs::remove_all(item.path, error);
        if (!error) {
            shrunk.removed.push_back(std::move(item));
            continue;
        }
        if (shrunk.stuck.empty()) shrunk.why = error.message();
        shrunk.stuck.push_back(std::move(item));
    }
    return shrunk;
}

}  // namespace

int made(Made what) {
    return made_here[static_cast<std::size_t>(what)];
}

void count(Made what) {
    ++made_here[static_cast<std::size_t>(what)];
}

fs::path cache_beside(const fs::path& output) {
    fs::path path = fs::absolute(output).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();  // "out/renal/"
    return path.parent_path() / "cache";
}

std::uintmax_t cache_limit() {
    constexpr double usual = 4000;
    const char* given = std::getenv("SELDINGER_CACHE_MB");
    const std::optional<double> wanted = given ? io::parse_number(given) : std::nullopt;
    return static_cast<std::uintmax_t>(1e6 * (wanted && *wanted >= 0 && *wanted < 1e9 ? *wanted : usual));
}

CachePlace::CachePlace(const ModelCache& cache, const std::string& name) : cache_(cache), name_(name) {
    if (cache.folder.empty()) return;
    path_ = cache.folder / name;
    io::make_private_folder(cache.folder);
    if (is_first(cache.folder)) {
        io::remove_leftovers(cache.folder);
        remove_old_locks(cache.folder);
    }
    const fs::path lock = cache.folder / ("." + name + ".lock");
    while (true) {
        lock_.emplace(io::LockFile::of(lock));
        if (lock_->held() || errno != EWOULDBLOCK) return;
        if (cache.progress) cache.progress(0.0, "waiting for another run, which makes the same");
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}

void CachePlace::used() const {
    if (path_.empty()) return;
    ::utimensat(AT_FDCWD, path_.c_str(), nullptr, 0);
    std::error_code none;
    if (name_.starts_with(ct_names) && fs::is_regular_file(fs::symlink_status(path_, none)))
        ::chmod(path_.c_str(), 0600);  // earlier versions let others read it
}

void CachePlace::failed(const std::string& why) const {
    if (!cache_.note || !is_first(cache_.folder / "cannot be written")) return;
    const std::string obstacle = obstacle_in(cache_.folder);
    cache_.note(fmt::format("{}: what was made cannot be kept, and is made again next time: {}",
                            cache_.folder.string(), obstacle.empty() ? why : obstacle));
}

bool CachePlace::keep_file(std::string_view bytes) const {
    if (path_.empty()) return false;
    // The folder may be gone since, or could not be made.
    std::string obstacle = obstacle_in(cache_.folder);
    if (obstacle.empty()) obstacle = clear_for_file(path_);
    if (!obstacle.empty()) {
        failed(obstacle);
        return false;
    }
    try {
        io::write_whole(path_, bytes, name_.starts_with(ct_names) ? io::Readers::Owner : io::Readers::Usual);
    } catch (const io::InputError& error) {
        failed(error.what());
        return false;
    }
    make_room();
    return true;
}

void CachePlace::make_room() const {
    used();  // the newest, it stays even where it alone is beyond the limit
    shrink_cache(cache_.folder, std::max(cache_limit(), size_of_item(path_)));
}

std::string sealed(std::uint64_t key, std::span<const std::byte> state) {
    Seal seal;
    seal.key = key;
    seal.checksum = geometry::checksum(state);
    std::string file(reinterpret_cast<const char*>(&seal), sizeof seal);
    return file.append(reinterpret_cast<const char*>(state.data()), state.size());
}

std::span<const std::byte> unsealed(std::uint64_t key, std::span<const std::byte> file) {
    Seal seal;
    if (file.size() < sizeof seal) return {};
    std::memcpy(&seal, file.data(), sizeof seal);
    const std::span<const std::byte> state = file.subspan(sizeof seal);
    const bool whole = std::memcmp(seal.magic, Seal().magic, sizeof seal.magic) == 0 && seal.key == key &&
                       seal.checksum == geometry::checksum(state);
    return whole ? state : std::span<const std::byte>();
}

std::vector<CacheItem> cache_items(const fs::path& folder) {
    std::vector<CacheItem> items;
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const std::string name = entry->path().filename().string();
        const bool ours =
            std::ranges::any_of(kept_names, [&](std::string_view start) { return name.starts_with(start); });
        std::error_code gone;
        const fs::file_time_type used = fs::last_write_time(entry->path(), gone);
        if (!ours || name.ends_with(".part") || gone || entry->is_symlink(gone)) continue;
        items.push_back({entry->path(), size_of_item(entry->path()), used, name.starts_with(ct_names)});
    }
    std::ranges::sort(items, [](const CacheItem& a, const CacheItem& b) {
        return a.used != b.used ? a.used > b.used : a.path < b.path;
    });
    return items;
}

ShrunkCache shrink_cache(const fs::path& folder, std::uintmax_t limit) {
    std::vector<CacheItem> going;
    for (CacheItem& item : cache_items(folder)) {
        if (limit > 0 && item.bytes <= limit) {
            limit -= item.bytes;
            continue;
        }
        limit = 0;
        going.push_back(std::move(item));
    }
    return removed(std::move(going));
}

ShrunkCache remove_of_ct(const fs::path& folder) {
    io::remove_leftovers(folder);
    std::vector<CacheItem> going = cache_items(folder);
    std::erase_if(going, [](const CacheItem& item) { return !item.of_ct; });
    return removed(std::move(going));
}

}  // namespace anatomy
