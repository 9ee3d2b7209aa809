#include "brushgs/light_along.hpp"

#include <cstdint>

#include "brushgs/key_order.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

void light_along(const LightAlong& query) {
    const std::size_t count = query.count;
    const auto keys = make_buffer<std::uint64_t>(count);
    keys_of(query.places, count, keys.get());
    const auto rows = rows_by_key(keys.get(), count, 1);
    const auto places = make_buffer<double>(count), passed = make_buffer<double>(count + 1);
    double sum = passed[0] = 0;
    for (std::size_t i = 0; i < count; ++i) {
        places[i] = query.places[rows[i]];
        passed[i + 1] = sum += query.depths[rows[i]];
    }
    // The first place above reach, the first within, the first equal and the first above: each only moves up.
    std::size_t ahead = 0, behind = 0, first = 0, past = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double place = places[i];
        while (ahead < count && places[ahead] <= place + query.reach) ++ahead;
        while (places[behind] < place - query.reach) ++behind;
        if (past <= i) {
            first = i;
            for (past = i + 1; past < count && places[past] == place;) ++past;
        }
        query.from_above[rows[i]] = passed[past] - passed[ahead];
        query.from_below[rows[i]] = passed[behind] - passed[first];
    }
}

}  // namespace brushgs
