#pragma once
/// Types of the numbers in binary files.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <string_view>

namespace io {

enum class NumberType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Float32, Float64 };
std::size_t size_of(NumberType);  // [bytes]

/// A format's names of each type, in the order of NumberType, separated by commas.
using NumberNames = std::array<std::string_view, 10>;
std::optional<NumberType> number_type_named(std::string_view name, const NumberNames&);

/// Returns use(T()), where T is the type that stores such numbers.
template <class Use>
auto with_stored_type(NumberType type, const Use& use) {
    switch (type) {
        case NumberType::Int8:
            return use(std::int8_t{});
        case NumberType::UInt8:
            return use(std::uint8_t{});
        case NumberType::Int16:
            return use(std::int16_t{});
        case NumberType::UInt16:
            return use(std::uint16_t{});
        case NumberType::Int32:
            return use(std::int32_t{});
        case NumberType::UInt32:
            return use(std::uint32_t{});
        case NumberType::Int64:
            return use(std::int64_t{});
        case NumberType::UInt64:
            return use(std::uint64_t{});
        case NumberType::Float32:
            return use(float{});
        case NumberType::Float64:
            break;
    }
    return use(double{});
}

/// The number whose bytes begin at `at`.
template <class Stored>
Stored stored_number(const char* at, bool big_endian) {
    std::array<char, sizeof(Stored)> raw;
    std::copy_n(at, raw.size(), raw.begin());
    if (big_endian != (std::endian::native == std::endian::big)) std::ranges::reverse(raw);
    return std::bit_cast<Stored>(raw);
}

}  // namespace io
