#pragma once
/// What the room shows, as JSON for the page.

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/exercise/grade.h"
#include "engine/room/guide.h"
#include "engine/room/keys.h"
#include "engine/room/session.h"
#include "engine/room/way_map.h"
#include "engine/scenario/scenario.h"
#include "render/panel/readout.h"
#include "render/picture/image.h"

namespace app {

using Json = nlohmann::ordered_json;

/// Numbers of a state that is none are null, as JSON has no others.
Json number(std::optional<double>);
Json readout_of(const render::Readout&);
Json guide_of(const room::Guide&, const room::KeyMap&);
Json size_of(const std::shared_ptr<const render::GrayImage>&);
Json grade_lines(const exercise::Grade&);
Json notes_of(const exercise::Grade&, const scenario::Scenario&);
/// What happened; errors with the run and the image of their moment.
Json events_of(const room::View&);
Json runs_of(const room::View&);
Json map_of(const room::WayMap&);

}  // namespace app
