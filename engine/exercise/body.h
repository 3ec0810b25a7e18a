#pragma once
/// The synthetic patient around the vessels: made once, kept in the cache, shared within a process.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "render/patient/texture_pattern.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/fluoroscope.h"

namespace exercise {

struct Body {
    geometry::Vec3 origin;  // of the body frame (render/patient/body.h) in that of the vessels [mm]
    /// At rest; each has been found to be closed. The lumen is not among them.
    std::vector<render::TissueLayer> layers;
    std::vector<render::LayerTexture> textures;    // of each layer; none: blobs are one by one
    std::optional<render::MeteredLayers> metered;  // what exposure meters need of these
};

/// Of the body, which lives as long as a meter uses this: others may share it until then.
std::shared_ptr<const render::MeteredLayers> metered(std::shared_ptr<const Body>);

/// The body of these vessels: the one that others in this process have, else the one in the cache, else made,
/// which takes seconds, and kept there as body-KEY.bin. It depends on the vessels alone, and has the same
/// bits either way. A damaged file is replaced.
std::shared_ptr<const Body> body_around(const anatomy::Anatomy&, const anatomy::ModelCache& = {});

/// Covers all that the body of these vessels depends on, and how bodies are made.
std::uint64_t body_key(const anatomy::Anatomy&);

/// Whether the cache has it, whole.
bool body_is_kept(const anatomy::Anatomy&, const anatomy::ModelCache&);

/// A body as it is kept; and back. Empty unless the bytes are those of the body with this key, undamaged.
std::string bytes_of(const Body&, std::uint64_t key);
std::shared_ptr<const Body> body_of(std::span<const std::byte>, std::uint64_t key);

}  // namespace exercise
