#pragma once
/// Published dimensions of vessels, and how each is measured in a grown tree.

#include <optional>
#include <span>
#include <string_view>

#include "engine/anatomy/grow/vessel_tree.h"

namespace studies {

struct PublishedFigure {
    std::string_view preset, quantity;  // the latter with its unit
    double mean, deviation;
    std::optional<anatomy::Sex> sex;  // published for one sex alone
    std::string_view source;          // "estimate" where nothing is published
    double (*measured)(const anatomy::VesselTree&);
};

std::span<const PublishedFigure> published_figures();

}  // namespace studies
