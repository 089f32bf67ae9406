/* The affine maps that move the subtrees of nodes (FORMAT.md, "Reconstruction"). */
#ifndef ATH_MODEL_MAPS_H
#define ATH_MODEL_MAPS_H

#include "model/motion.h"

/* Leaves the node's map x = point + rotation (x0 - a) in scratch->at. */
void ath_node_map(const ath_plan *plan, const ath_motion *motion, int32_t n, const ath_piece_rows *piece_rows,
                  const ath_node_rows *rows, const ath_scratch *scratch);
/* Fills the affine part of a mode: g = mean over the node's vertices of mode(x) (x0 - a), whitened twice. */
void ath_affine_part(const ath_plan *plan, const ath_node *node, const double *mode, double g[3]);
/* Returns the stream of a node's map: the waves of motion->waves, quantised by the node's own step. */
ath_stream ath_node_stream(const ath_motion *motion, double step);

#endif
