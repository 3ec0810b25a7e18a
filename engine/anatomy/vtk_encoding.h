#pragma once
/// The bytes of an array in an XML file of VTK: raw or in base64, as they are or in blocks of zlib.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace anatomy {

struct VtkEncoding {
    bool base64 = false, compressed = false, big_endian = false;
    bool wide = false;  // lengths are of 64 bits, else of 32
};

/// Called with what was found and what is accepted; throws.
using RefuseBytes = std::function<void(const std::string& found, const std::string& accepted)>;

/// The array that begins where the text does; what follows it is not looked at. An array of more than `most`
/// bytes, one that is not whole, or one that does not unpack is refused before memory is taken for it.
std::string array_bytes(std::string_view text, const VtkEncoding&, std::uint64_t most,
                        const RefuseBytes& refuse);

}  // namespace anatomy
