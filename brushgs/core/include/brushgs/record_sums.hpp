// The sums of a tile for its records.
#pragma once

namespace brushgs {

// The sums of some records of a tile, in the order of its list. Most lists are longer than their visible part.
template <class T>
struct RecordSums {
    T* values;      // [num_ids, as many as the tile sums], those of records that paint nothing in the tile unset
    bool* is_seen;  // [num_ids] whether a record paints in the tile
};

}  // namespace brushgs
