#pragma once
/// What an exercise has in the cache as one file, to be sent to browsers: about an eighth of the bytes.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace exercise {

/// A file of the cache.
struct CarriedFile {
    std::string name, bytes;
};

/// Packs files of a cache for transport: they come back byte for byte. The fields are those of this anatomy,
/// and are made anew. Throws io::InputError for a file that is none of these, and for one that would not come
/// back.
std::string packed_for_transport(const std::vector<CarriedFile>&, const anatomy::Anatomy&);

/// The files again, to be written to a cache. Throws io::InputError, which says what is wrong, for bytes that
/// are not whole or not those that were packed. Never makes more than `largest_unpacked` of a file.
std::vector<CarriedFile> unpacked_from_transport(std::span<const std::byte>);
constexpr std::size_t largest_unpacked = std::size_t{256} << 20;  // [bytes]

}  // namespace exercise
