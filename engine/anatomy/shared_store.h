#pragma once
/// What is costly to make or read, once a process: those who want the same thing share it while any of them
/// has it.

#include <map>
#include <memory>
#include <mutex>

namespace anatomy {

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
