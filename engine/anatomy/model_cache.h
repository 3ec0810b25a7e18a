#pragma once
/// Where results that take seconds to make are kept between runs: generated vessels, the distance fields of
/// their walls, bodies around them and views of these, prepared CTs. Within a process those who want the same
/// thing share it.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/files.h"

namespace anatomy {

/// With a folder that cannot be written to, or an empty path, everything is merely made anew every time.
struct ModelCache {
    std::filesystem::path folder;
    std::function<void(double part, const char* what)>
        progress;  // called with 0 to 1 while something is made
    /// Called with a sentence when something cannot be kept, once a process and folder.
    std::function<void(const std::string&)> note = {};
};

/// What takes so long that it is kept.
enum class Made { Vessels, Field, Body, Volume };
/// How many of them this process has made because no cache had them.
int made(Made);
/// Counts one; to be called by what makes it.
void count(Made);

/// The usual folder: cache, next to an output file or folder.
std::filesystem::path cache_beside(const std::filesystem::path& output);

/// One file in the cache, which is made as a folder of its owner alone. What is of a CT, as its name says, is
/// readable by its owner alone, also where the folder was there and is open to others. While this exists, no
/// other process looks for the same thing or makes it: processes that need the same thing share the work.
class CachePlace {
public:
    /// Waits while another process has the place. What processes that ended have left unfinished is removed.
    CachePlace(const ModelCache&, const std::string& name);
    ~CachePlace() = default;
    CachePlace(const CachePlace&) = delete;
    CachePlace& operator=(const CachePlace&) = delete;

    bool exists() const { return !path_.empty(); }  // false without a cache
    const std::filesystem::path& path() const { return path_; }

    /// To be called when the thing was found and used: what was not used for longest is removed first.
    void used() const;
    /// Puts the bytes in the place, and removes the things that were not used for longest until the cache is
    /// within its limit. A failure is noted, no error. Whether the place has it now.
    bool keep_file(std::string_view bytes) const;
    /// Notes that what was made cannot be kept.
    void failed(const std::string& why) const;

private:
    void make_room() const;

    const ModelCache& cache_;
    std::string name_;
    std::filesystem::path path_;
    std::optional<io::LockFile> lock_;
};

/// The bytes of a state as a file of the cache, with what tells whether they are whole and those of this key.
std::string sealed(std::uint64_t key, std::span<const std::byte> state);
/// The state in such a file; empty where it is damaged, or not of this key.
std::span<const std::byte> unsealed(std::uint64_t key, std::span<const std::byte> file);

/// A thing in a cache.
struct CacheItem {
    std::filesystem::path path;
    std::uintmax_t bytes = 0;
    std::filesystem::file_time_type used;
    bool of_ct = false;  // it has voxels of a patient's CT
};
/// The things in the folder that this program has put there, those used last first; nothing of anything else.
std::vector<CacheItem> cache_items(const std::filesystem::path& folder);
/// What a cache was relieved of, and what should have gone but cannot be removed.
struct ShrunkCache {
    std::vector<CacheItem> removed, stuck;
    std::string why;  // the first of those is stuck
};
/// Removes the things that were not used for longest until at most so many bytes are left.
ShrunkCache shrink_cache(const std::filesystem::path& folder, std::uintmax_t limit);
/// Removes all that has voxels of a CT, also what processes that have ended left unfinished.
ShrunkCache remove_of_ct(const std::filesystem::path& folder);
/// Most bytes that the cache may hold: SELDINGER_CACHE_MB million, or 4000 million.
std::uintmax_t cache_limit();

/// Things by a key that holds all they depend on. To be used by many threads at a time: one makes a thing
/// while those that want the same wait, and others go on.
template <class Key, class Thing>
class SharedStore {
public:
    /// The thing that somebody has, else `make()`, which returns a std::shared_ptr. What it throws is passed
    /// on, and nothing is kept.
    template <class Make>
    std::shared_ptr<const Thing> get(const Key& key, const Make& make) {
        const std::shared_ptr<Place> place = place_of(key);
        const std::lock_guard lock(place->mutex);
        std::shared_ptr<const Thing> thing = place->thing.lock();
        if (!thing) place->thing = thing = make();
        return thing;
    }

private:
    struct Place {
        std::mutex mutex;
        std::weak_ptr<const Thing> thing;
    };

    std::shared_ptr<Place> place_of(const Key& key) {
        const std::lock_guard lock(mutex_);
        // A place that only this map has is in nobody's hands.
        std::erase_if(places_, [](const auto& known) {
            return known.second.use_count() == 1 && known.second->thing.expired();
        });
        std::shared_ptr<Place>& place = places_[key];
        if (!place) place = std::make_shared<Place>();
        return place;
    }

    std::mutex mutex_;
    std::map<Key, std::shared_ptr<Place>> places_;
};

}  // namespace anatomy
