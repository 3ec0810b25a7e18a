#include "engine/episode/store.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <list>
#include <mutex>
#include <system_error>

#include "engine/scenario/scenario.h"

namespace episode {
namespace {

namespace fs = std::filesystem;

/// A file or folder as it was when it was read.
struct Stamp {
    fs::path path;
    fs::file_time_type changed;
    std::uintmax_t bytes = 0;
    bool operator==(const Stamp&) const = default;
};

Stamp stamp_of(const fs::path& path) {
    std::error_code error;
    Stamp stamp{path, fs::last_write_time(path, error), 0};
    if (error) stamp.changed = fs::file_time_type::min();
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (!error) stamp.bytes = bytes;
    return stamp;
}

std::vector<Stamp> stamps_of(const scenario::Scenario& scenario) {
    std::vector<Stamp> stamps;
    for (const fs::path& path : scenario::inputs_of(scenario)) {
        stamps.push_back(stamp_of(path));
        std::error_code error;
        if (!fs::is_directory(path, error)) continue;
        for (fs::recursive_directory_iterator entry(path, error), end; !error && entry != end;
             entry.increment(error))
            stamps.push_back(stamp_of(entry->path()));
    }
    return stamps;
}

struct First {
    Source source;
    fs::path cache;
    std::vector<Stamp> read;
    std::shared_ptr<const Episode> episode;
};

/// The ones used last, at the front.
class Firsts {
public:
    std::shared_ptr<const Episode> find(const Source& source, const fs::path& cache) {
        const std::lock_guard lock(mutex_);
        const auto known = std::ranges::find_if(
            firsts_, [&](const First& first) { return first.source == source && first.cache == cache; });
        if (known == firsts_.end()) return nullptr;
        const bool unchanged = std::ranges::all_of(
            known->read, [](const Stamp& stamp) { return stamp_of(stamp.path) == stamp; });
        if (!unchanged) {
            firsts_.erase(known);
            return nullptr;
        }
        firsts_.splice(firsts_.begin(), firsts_, known);
        return firsts_.front().episode;
    }
    void keep(First first) {
        const std::lock_guard lock(mutex_);
        std::erase_if(firsts_, [&](const First& known) {
            return known.source == first.source && known.cache == first.cache;
        });
        firsts_.push_front(std::move(first));
        if (firsts_.size() > most) firsts_.pop_back();
        for (auto known = firsts_.begin(); known != firsts_.end(); ++known)
            if (std::distance(firsts_.begin(), known) >= most_patients) known->episode->patient()->forget();
    }

private:
    static constexpr std::size_t most = 16;             // a few MB each
    static constexpr std::ptrdiff_t most_patients = 4;  // with images: more than 100 MB each
    std::mutex mutex_;
    std::list<First> firsts_;
};

}  // namespace

scenario::Scenario scenario_of(const Source& source) {
    std::vector<scenario::Override> values;
    for (const auto& [key, value] : source.overrides) values.push_back({key, value});
    return source.text ? scenario::parse_scenario(*source.text, source.file, source.catalogue, values)
                       : scenario::load_scenario(source.file, source.catalogue, values);
}

std::unique_ptr<Episode> open(const Source& source, const anatomy::ModelCache& cache) {
    // Never destroyed: at the end of the process threads of the rasteriser may be gone before it.
    static Firsts& firsts = *new Firsts;
    const auto made = [&](const scenario::Scenario& scenario) {
        auto episode = std::make_unique<Episode>(scenario, source.pictures, cache);
        if (source.room) episode->follow_room();
        return episode;
    };
    if (source.pictures == exercise::Pictures::All) return made(scenario_of(source));
    std::shared_ptr<const Episode> like = firsts.find(source, cache.folder);
    if (!like) {
        const scenario::Scenario scenario = scenario_of(source);
        // Before they are read: a file that changes meanwhile is read again for the next.
        std::vector<Stamp> read = stamps_of(scenario);
        like = made(scenario);
        firsts.keep({source, cache.folder, std::move(read), like});
    }
    return std::make_unique<Episode>(*like);
}

}  // namespace episode
