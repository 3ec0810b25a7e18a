#include "engine/exercise/transport.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "engine/anatomy/lumen_wall.h"
#include "engine/exercise/body.h"
#include "engine/exercise/packed_body.h"
#include "engine/io/error.h"
#include "physics/geometry/checksum.h"
#include "physics/wall/distance_field.h"

namespace exercise {
namespace {

using Bytes = std::span<const std::byte>;

Bytes bytes_of_text(const std::string& text) {
    return std::as_bytes(std::span(text));
}

/// Of the file. Entries follow, one after another, each with its packed bytes.
struct Head {
    char magic[8] = {'S', 'E', 'L', 'D', 'W', 'E', 'B', '\n'};
    std::uint64_t version = 2, entries = 0;
    std::uint64_t checksum = 0;  // of all that follows
};
struct EntryHead {
    char name[48] = {};                      // the rest is 0
    std::uint64_t packed = 0, unpacked = 0;  // [bytes]
    std::uint64_t packed_sum = 0, unpacked_sum = 0;
};
static_assert(sizeof(Head) == 32 && sizeof(EntryHead) == 80);
constexpr std::uint64_t most_entries = 16;

enum class Kind { Vessels, Field, Body, None };

/// By names as the cache has them: a word, 16 digits of its key, an ending.
Kind kind_of(std::string_view name) {
    const auto is = [&](std::string_view word) {
        return name.starts_with(word) && name.ends_with(".bin") && name.size() == word.size() + 20 &&
               std::ranges::all_of(name.substr(word.size(), 16),
                                   [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
    };
    return is("anatomy-") ? Kind::Vessels
           : is("field-") ? Kind::Field
           : is("body-")  ? Kind::Body
                          : Kind::None;
}
std::uint64_t key_in(std::string_view name) {
    std::uint64_t key = 0;
    const std::size_t from = name.find('-') + 1;
    std::from_chars(name.data() + from, name.data() + from + 16, key, 16);
    return key;
}

/// Bytes of words of eight, the first of all words first: gzip then packs a quarter better what is numbers.
/// `back` undoes it.
std::string by_columns(Bytes bytes, bool back) {
    constexpr std::size_t word = 8;
    const std::size_t words = bytes.size() / word;
    std::string all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (std::size_t w = 0; w < words; ++w)
        for (std::size_t k = 0; k < word; ++k) {
            const std::size_t here = w * word + k, there = k * words + w;
            all[back ? here : there] = static_cast<char>(bytes[back ? there : here]);
        }
    return all;
}

std::string unpacked(const std::string& name, Bytes packed, std::size_t largest) {
    try {
        switch (kind_of(name)) {
            case Kind::Vessels:
                return by_columns(packed, true);
            case Kind::Field:
                return physics::DistanceField::unpacked(packed, largest);
            case Kind::Body:
                return bytes_of(unpacked_body(packed, largest), key_in(name));
            case Kind::None:
                break;
        }
    } catch (const std::runtime_error& error) {
        throw io::InputError("{}: {}", name, error.what());
    } catch (const std::invalid_argument& error) {
        throw io::InputError("{}: {}", name, error.what());
    }
    throw io::InputError("'{}': expected vessels, a distance field or a body", name);
}

}  // namespace

std::string packed_for_transport(const std::vector<CarriedFile>& files, const anatomy::Anatomy& anatomy) {
    std::string entries;
    if (files.size() > most_entries)
        throw io::InputError("expected at most {} files, found {}", most_entries, files.size());
    for (const CarriedFile& file : files) {
        std::string packed;
        switch (kind_of(file.name)) {
            case Kind::Vessels:
                packed = by_columns(bytes_of_text(file.bytes), false);
                break;
            case Kind::Field: {
                std::optional<std::string> made = anatomy::packed_distance_field(anatomy, file.name);
                if (!made) throw io::InputError("{}: it is the field of other vessels", file.name);
                packed = *std::move(made);
                break;
            }
            case Kind::Body: {
                const auto body = body_of(bytes_of_text(file.bytes), key_in(file.name));
                if (!body) throw io::InputError("{}: the body is damaged", file.name);
                packed = packed_body(*body);
                break;
            }
            case Kind::None:
                throw io::InputError("'{}': expected vessels, a distance field or a body", file.name);
        }
        const std::string back = unpacked(file.name, bytes_of_text(packed), largest_unpacked);
        if (back != file.bytes) throw io::InputError("{}: it does not come back as it was", file.name);
        EntryHead head;
        std::ranges::copy(file.name, head.name);
        head.packed = packed.size();
        head.unpacked = back.size();
        head.packed_sum = geometry::checksum(bytes_of_text(packed));
        head.unpacked_sum = geometry::checksum(bytes_of_text(back));
        entries.append(reinterpret_cast<const char*>(&head), sizeof head).append(packed);
    }
    Head head;
    head.entries = files.size();
    head.checksum = geometry::checksum(bytes_of_text(entries));
    std::string all = std::string(reinterpret_cast<const char*>(&head), sizeof head) + entries;
    static_cast<void>(unpacked_from_transport(bytes_of_text(all)));  // by the lengths that it states
    return all;
}

std::vector<CarriedFile> unpacked_from_transport(Bytes bytes) {
    Head head;
    if (bytes.size() < sizeof head || std::memcmp(bytes.data(), head.magic, sizeof head.magic) != 0)
        throw io::InputError("expected the packed data of an exercise, found something else");
    std::memcpy(&head, bytes.data(), sizeof head);
    if (head.version != Head().version)
        throw io::InputError("the packed data of the exercise: expected version {}, found {}", Head().version,
                             head.version);
    bytes = bytes.subspan(sizeof head);
    if (head.entries > most_entries || geometry::checksum(bytes) != head.checksum)
        throw io::InputError("the packed data of the exercise are damaged, or cut short");
    std::vector<CarriedFile> files;
    for (std::uint64_t e = 0; e < head.entries; ++e) {
        EntryHead entry;
        if (bytes.size() < sizeof entry)
            throw io::InputError("the packed data of the exercise are cut short");
        std::memcpy(&entry, bytes.data(), sizeof entry);
        bytes = bytes.subspan(sizeof entry);
        if (entry.name[sizeof entry.name - 1] != 0)
            throw io::InputError("the packed data of the exercise are damaged");
        const std::string name = entry.name;
        if (kind_of(name) == Kind::None)
            throw io::InputError("'{}': expected vessels, a distance field or a body", name);
        if (entry.packed > bytes.size()) throw io::InputError("{}: cut short", name);
        if (entry.unpacked > largest_unpacked) throw io::InputError("{}: it would be too large", name);
        const Bytes packed = bytes.first(static_cast<std::size_t>(entry.packed));
        bytes = bytes.subspan(packed.size());
        if (geometry::checksum(packed) != entry.packed_sum) throw io::InputError("{}: damaged", name);
        std::string file = unpacked(name, packed, static_cast<std::size_t>(entry.unpacked));
        if (file.size() != entry.unpacked || geometry::checksum(bytes_of_text(file)) != entry.unpacked_sum)
            throw io::InputError("{}: other bytes came out than had been packed", name);
        files.push_back({name, std::move(file)});
    }
    if (!bytes.empty()) throw io::InputError("the packed data of the exercise go on after their end");
    return files;
}

}  // namespace exercise
