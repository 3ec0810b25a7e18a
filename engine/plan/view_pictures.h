#pragma once
/// Pictures of views: the map of angles, and what the monitor would show.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/anatomy/model_cache.h"
#include "engine/plan/views.h"
#include "engine/scenario/scenario.h"
#include "render/picture/image.h"

namespace plan {

/// A row for each node: angles [deg], figures, cost, and whether the stand takes it, in words.
std::string to_csv(const ViewMap&);

/// NAME.gp, NAME.svg and NAME.png in the folder: cost, foreshortening and overlap over the angles, with the
/// best views numbered. Returns an empty text, or why there is no picture. Throws InputError where the script
/// cannot be written.
std::string write_map_picture(const ViewMap&, const std::vector<BestView>&, const ViewTarget&,
                              const std::filesystem::path& folder, const std::string& name);

/// An angiogram of the filled branches in each view, subtracted, at the start of the scenario, with the
/// target's middle in the middle and a field that shows its surroundings. Throws InputError.
std::vector<render::GrayImage> view_pictures(const scenario::Scenario&, const ViewedTarget&,
                                             const std::vector<bool>& filled, const std::vector<BestView>&,
                                             const anatomy::ModelCache& = {});

}  // namespace plan
