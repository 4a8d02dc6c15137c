//! How the resting surface lies behind one pixel: which place of the material each place in the pixel sees.

use super::camera::Camera;
use super::paint::Painted;
use super::raster::View;
use super::surface::NONE;

/// Steps from triangle to triangle within a pixel.
const STEPS: usize = 6;

/// The ray of a pixel's centre, and how it changes from pixel to pixel: rows x and y, columns u and v.
pub(super) struct Sight {
    pub(super) ray: [f64; 2],
    slope: [[f64; 2]; 2],
}

impl Sight {
    pub(super) fn new(camera: &Camera, ray: [f64; 2]) -> Option<Self> {
        Some(Self { ray, slope: camera.lens.ray_slope(ray)? })
    }

    /// The ray of another place in the pixel (px from its centre).
    pub(super) fn at(&self, off: [f64; 2]) -> [f64; 2] {
        let [across, down] = &self.slope;
        [
            self.ray[0] + across[0] * off[0] + across[1] * off[1],
            self.ray[1] + down[0] * off[0] + down[1] * off[1],
        ]
    }
}

/// A triangle as one pixel sees it. All is linear within the pixel.
pub(super) struct Local {
    pub(super) triangle: u32,
    /// Weights of the corners at the pixel's centre, and their change per pixel along columns and rows.
    pub(super) weights: [f64; 3],
    steps: [[f64; 3]; 2],
    /// Whether the whole pixel lies on the triangle.
    alone: bool,
    /// Place in the dot's plane at the pixel's centre (m), and its change per pixel.
    place: [f64; 2],
    pub(super) moves: [[f64; 2]; 2],
}

impl Local {
    pub(super) fn new(view: &View, painted: &Painted, triangle: u32, sight: &Sight) -> Self {
        let weights = view.placed.weights(triangle, sight.ray);
        let rows = &view.placed.rows[triangle as usize];
        let [[xu, xv], [yu, yv]] = sight.slope;
        let mut steps = [[0.0; 3]; 2];
        let mut alone = true;
        for (i, row) in rows.iter().enumerate() {
            steps[0][i] = row.x * xu + row.y * yu;
            steps[1][i] = row.x * xv + row.y * yv;
            alone &= weights[i] > 0.5 * (steps[0][i].abs() + steps[1][i].abs());
        }
        let sum = weights[0] + weights[1] + weights[2];
        let [a, b, c] = view.surface.corners(triangle, view.surface.rest());
        let corners = [painted.flat(&a), painted.flat(&b), painted.flat(&c)];
        let mean =
            |w: &[f64; 3], k: usize| w[0] * corners[0][k] + w[1] * corners[1][k] + w[2] * corners[2][k];
        let place = [mean(&weights, 0) / sum, mean(&weights, 1) / sum];
        let mut moves = [[0.0; 2]; 2];
        for (moves, steps) in moves.iter_mut().zip(&steps) {
            let thinner = steps[0] + steps[1] + steps[2];
            for k in 0..2 {
                moves[k] = (mean(steps, k) - place[k] * thinner) / sum;
            }
        }
        Self { triangle, weights, steps, alone, place, moves }
    }

    /// Whether a place in the pixel lies on the triangle.
    pub(super) fn holds(&self, off: [f64; 2]) -> bool {
        self.alone || self.weights_at(off).iter().all(|&w| w >= 0.0)
    }

    pub(super) fn weights_at(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let at = |i: usize| self.weights[i] + self.steps[0][i] * u + self.steps[1][i] * v;
        [at(0), at(1), at(2)]
    }

    /// How far outside the dot's edge a place in the pixel is (px, to first order), the direction in the picture that leads outward,
    /// and the radius of the edge (px).
    pub(super) fn outside(&self, painted: &Painted, [u, v]: [f64; 2]) -> (f64, [f64; 2], f64) {
        let [across, down] = &self.moves;
        let place =
            [self.place[0] + across[0] * u + down[0] * v, self.place[1] + across[1] * u + down[1] * v];
        let distance = (place[0] * place[0] + place[1] * place[1]).sqrt().max(1e-15);
        let outward = [place[0] / distance, place[1] / distance];
        let steep =
            [outward[0] * across[0] + outward[1] * across[1], outward[0] * down[0] + outward[1] * down[1]];
        let finer = 1.0 / (steep[0] * steep[0] + steep[1] * steep[1]).sqrt();
        let radius = painted.radius(outward);
        ((distance - radius) * finer, [steep[0] * finer, steep[1] * finer], radius * finer)
    }
}

impl View<'_> {
    /// Goes on to the triangle that holds a place in the pixel; false where there is none. `left` remembers the one before.
    pub(super) fn walk(
        &self,
        painted: &Painted,
        local: &mut Local,
        left: &mut Option<Local>,
        off: [f64; 2],
        sight: &Sight,
    ) -> bool {
        if let Some(before) = left
            && before.holds(off)
        {
            std::mem::swap(local, before);
            return true;
        }
        for _ in 0..STEPS {
            let weights = local.weights_at(off);
            let (corner, least) =
                (0..3).map(|i| (i, weights[i])).fold((0, 0.0), |m, w| if w.1 < m.1 { w } else { m });
            if least >= 0.0 {
                return true;
            }
            let next = self.surface.neighbours(local.triangle)[corner];
            if next == NONE || !self.placed.faces(next) {
                return false;
            }
            *left = Some(std::mem::replace(local, Local::new(self, painted, next, sight)));
        }
        true
    }
}
