/* Ball joints: the coordinates of their three angles, those of joints that turn freely in a step first. Effects can divide an angle. */
enum { NAME_COORDINATES = COORDINATES, NAME_BALLS = BALLS, NAME_FREE_BALLS = FREE_BALLS };

static const int NAME_ball_first[] = {FIRST};
static const int NAME_ball_places[] = {PLACES};

/* No rotation, for each joint that turns freely: what its angles begin at outside of steps. */
static const double NAME_upright[] = {UPRIGHT};

static double NAME_angle(const double *numbers, int ball, int which)
{
    double sum = 0.0;
    int k;
    for (k = NAME_ball_first[3 * ball + which]; k < NAME_ball_first[3 * ball + which + 1]; ++k) sum += numbers[NAME_ball_places[k]];
    return sum;
}

/* Whether the middle angle of a ball joint, from number `first` on, is too near to 90 degrees for steps of h seconds. */
static int NAME_near(const double *x, int first, double h)
{
    int ball;
    for (ball = first; ball < NAME_BALLS; ++ball) {
        const double *v = x + NAME_COORDINATES, cosine = cos(NAME_angle(x, ball, 1));
        const double turning = hypot(NAME_angle(v, ball, 1), NAME_angle(v, ball, 0) * cosine);
        if (!(fabs(cosine) >= fmax(LEAST_COSINE, STEPS_AWAY * fabs(h) * turning))) return NAME_ANGLES;
    }
    return NAME_OK;
}

/* A cosine that is not too near to zero to be divided by. */
static double NAME_regular(double cosine)
{
    return fabs(cosine) >= SHOWN_COSINE ? cosine : cosine < 0.0 ? -(SHOWN_COSINE) : SHOWN_COSINE;
}

/* The angle next to `near` that has this sine and cosine, up to a positive factor of both. */
static double NAME_next(double sine, double cosine, double near)
{
    const double turns = (atan2(sine, cosine) - near) / FULL_TURN, value = near + (turns - round(turns)) * FULL_TURN;
    const double s = sin(value), c = cos(value);
    return value + atan((sine * c - cosine * s) / (cosine * c + sine * s));
}

/* The unit quaternion of Rx(a) Ry(b) Rz(c), real part first. */
static void NAME_quaternion(const double *angles, double *q)
{
    const double sx = sin(0.5 * angles[0]), sy = sin(0.5 * angles[1]), sz = sin(0.5 * angles[2]);
    const double cx = cos(0.5 * angles[0]), cy = cos(0.5 * angles[1]), cz = cos(0.5 * angles[2]);
    q[0] = cx * cy * cz - sx * sy * sz;
    q[1] = sx * cy * cz + cx * sy * sz;
    q[2] = cx * sy * cz - sx * cy * sz;
    q[3] = cx * cy * sz + sx * sy * cz;
}

/* The angular velocity in axes of the child at these angles and their rates. */
static void NAME_angular_velocity(const double *angles, const double *rates, double *omega)
{
    const double sb = sin(angles[1]), cb = cos(angles[1]), sc = sin(angles[2]), cc = cos(angles[2]);
    omega[0] = rates[0] * cb * cc + rates[1] * sc;
    omega[1] = rates[1] * cc - rates[0] * cb * sc;
    omega[2] = rates[0] * sb + rates[2];
}

/* The rotation p, then by `local` angles: as angles, which go on from what `angles` hold. */
static void NAME_turn_on(const double *p, const double *local, double *angles)
{
    double r[4], w, x, y, z, length, sa, ca, zy, zz;
    NAME_quaternion(local, r);
    w = p[0] * r[0] - p[1] * r[1] - p[2] * r[2] - p[3] * r[3];
    x = p[0] * r[1] + p[1] * r[0] + p[2] * r[3] - p[3] * r[2];
    y = p[0] * r[2] + p[2] * r[0] + p[3] * r[1] - p[1] * r[3];
    z = p[0] * r[3] + p[3] * r[0] + p[1] * r[2] - p[2] * r[1];
    length = sqrt(w * w + x * x + y * y + z * z);
    w /= length;
    x /= length;
    y /= length;
    z /= length;
    zy = 2.0 * (y * z - w * x);
    zz = 1.0 - 2.0 * (x * x + y * y);
    if (hypot(zy, zz) >= SHOWN_COSINE) {
        /* Of the two triples that every orientation has, the one whose first angle is nearer. */
        const double side = zz * cos(angles[0]) < zy * sin(angles[0]) ? -1.0 : 1.0;
        angles[0] = NAME_next(-zy * side, zz * side, angles[0]);
    }
    sa = sin(angles[0]);
    ca = cos(angles[0]);
    angles[1] = NAME_next(2.0 * (x * z + w * y), NAME_regular(zz * ca - zy * sa), angles[1]);
    angles[2] = NAME_next(2.0 * ((x * y + w * z) * ca + (x * z - w * y) * sa),
                          (1.0 - 2.0 * (x * x + z * z)) * ca + 2.0 * (y * z + w * x) * sa, angles[2]);
}

/* The state x in coordinates of a step: joints that turn freely begin at their orientations q with angles of zero, whose rates are then
   the angular velocity. Munthe-Kaas 1999; Hairer, Lubich & Wanner 2006, Geometric Numerical Integration, section IV.8. */
static void NAME_enter(const double *x, double *local, double *q)
{
    int ball, k;
    for (k = 0; k < NAME_NX; ++k) local[k] = x[k];
    for (ball = 0; ball < NAME_FREE_BALLS; ++ball) {
        const int *place = NAME_ball_places + NAME_ball_first[3 * ball];
        double angles[3], rates[3], omega[3];
        for (k = 0; k < 3; ++k) {
            angles[k] = x[place[k]];
            rates[k] = x[NAME_COORDINATES + place[k]];
        }
        NAME_quaternion(angles, q + 4 * ball);
        NAME_angular_velocity(angles, rates, omega);
        for (k = 0; k < 3; ++k) {
            local[place[k]] = 0.0;
            local[NAME_COORDINATES + place[k]] = omega[k];
        }
    }
}

/* The state `next` after a step of h seconds from x, which has led to `local`. */
static int NAME_arrive(const double *x, const double *q, double h, double *local, double *next)
{
    int ball, k;
    if (NAME_near(x, NAME_FREE_BALLS, 0.0) != NAME_OK || NAME_near(local, NAME_FREE_BALLS, h) != NAME_OK) return NAME_ANGLES;
    for (ball = NAME_FREE_BALLS; ball < NAME_BALLS; ++ball) {
        const double before = NAME_angle(x, ball, 1) / HALF_TURN + 0.5, after = NAME_angle(local, ball, 1) / HALF_TURN + 0.5;
        if (floor(before) != floor(after)) return NAME_ANGLES;
    }
    for (ball = 0; ball < NAME_FREE_BALLS; ++ball) {
        const int *place = NAME_ball_places + NAME_ball_first[3 * ball];
        double turned[3], rates[3], angles[3], omega[3], sb, cb, sc, cc;
        for (k = 0; k < 3; ++k) {
            turned[k] = local[place[k]];
            rates[k] = local[NAME_COORDINATES + place[k]];
            angles[k] = x[place[k]];
        }
        if (!(fabs(turned[1]) <= LARGEST_TURN)) return NAME_ANGLES;
        NAME_turn_on(q + 4 * ball, turned, angles);
        NAME_angular_velocity(turned, rates, omega);
        sb = sin(angles[1]);
        cb = cos(angles[1]);
        sc = sin(angles[2]);
        cc = cos(angles[2]);
        rates[0] = (cc * omega[0] - sc * omega[1]) / NAME_regular(cb);
        rates[1] = sc * omega[0] + cc * omega[1];
        rates[2] = omega[2] - rates[0] * sb;
        for (k = 0; k < 3; ++k) {
            local[place[k]] = angles[k];
            local[NAME_COORDINATES + place[k]] = rates[k];
        }
    }
    for (k = 0; k < NAME_NX; ++k) next[k] = local[k];
    return NAME_OK;
}

