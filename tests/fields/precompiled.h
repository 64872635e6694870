// What the tests of kinds and fields include besides; see ../precompiled.h.
#include "../precompiled.h"
#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"
