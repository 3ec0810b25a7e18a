#include "engine/io/number_type.h"

#include "engine/io/text.h"

namespace io {

std::size_t size_of(NumberType type) {
    return with_stored_type(type, [](auto stored) { return sizeof stored; });
}

std::optional<NumberType> number_type_named(std::string_view name, const NumberNames& names) {
    for (std::size_t type = 0; type < names.size(); ++type)
        for (const std::string_view known : split(names[type], ','))
            if (known == name && !name.empty()) return static_cast<NumberType>(type);
    return std::nullopt;
}

}  // namespace io
