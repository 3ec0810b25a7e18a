#pragma once
/// Episodes of one source share what they are made from.

#include <compare>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/episode/episode.h"

namespace episode {

/// What an episode is made from.
struct Source {
    std::string file;                                            // of the scenario
    std::optional<std::string> text;                             // in its place
    std::string catalogue;                                       // folder of devices
    std::vector<std::pair<std::string, std::string>> overrides;  // key and value, in TOML
    exercise::Pictures pictures = exercise::Pictures::None;
    bool room = false;  // the panel's readouts are followed

    auto operator<=>(const Source&) const = default;
};

/// Reads the scenario. Throws InputError.
scenario::Scenario scenario_of(const Source&);

/// An episode at its start, the same to the bit as one made alone. The process keeps those made last, of
/// which others of the same source are copies (the last few with their patients' images), until a file that
/// they are read from changes (its size or the time of its last change). With Pictures::All nothing is
/// shared. Throws InputError as Episode does. May be called by many threads at a time.
std::unique_ptr<Episode> open(const Source&, const anatomy::ModelCache&);

}  // namespace episode
